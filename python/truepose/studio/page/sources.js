// The tab of the sources: each alone, at the pose shown and over the workspace, those too that the
// page itself cannot work out.

const sourcesTab = {
  name: "sources", answer: "known",
  build(host, {said, words, tell}) {
    return {
      show({sources, error, status}) {
        const quantities = tell.quantities(), components = tell.components();
        const heads = [words.source];
        for (const name of quantities) {
          const quantity = tell.quantity(name);
          heads.push([`${quantity}: ${words.lines.known}`, "number"],
            [`${quantity}: ${said.lines.linear}`, "number"],
            [`${quantity}: ${said.highest_over}`, "number"]);
        }
        const by = name => sources.map(source => source.highest[name] ?? 0);
        const order = sources.map((_, at) => at).sort((a, b) => by(quantities[0])[b] - by(quantities[0])[a]);
        const rows = order.map(at => {
          const {name, error: alone, linear_maximum: reach, highest} = sources[at];
          return [name, ...quantities.flatMap(quantity => [
            tell.cell(alone ? sizeOf(alone, components, quantity) : null, quantity, `studio.${name}.${quantity}`),
            tell.cell(reach ? reach[quantity] : null, quantity),
            tell.cell(highest[quantity], quantity),
          ])];
        });
        host.replaceChildren(
          scrolling(tableOf(heads, rows), said.tabs.sources),
          element("p", {className: "caption"}, error ? said.sources_caption
            : words.statuses[status] || status));
      },
    };
  },
};
