// The tab of the error budget: sources ranked as `truepose budget` ranks them.

const budgetTab = {
  name: "budget", asked: true,
  build(host, {said, words, tell}) {
    return {
      show({rows, left_out: out}) {
        const quantities = tell.quantities();
        const heads = [words.source, [said.rank, "number"], [said.share, "number"], said.weight,
          ...quantities.flatMap(name => [
            [`${tell.quantity(name)}: ${said.highest_over}`, "number"],
            [`${tell.quantity(name)}: ${said.rms}`, "number"],
          ])];
        const cells = rows.map(({name, rank, share, verdict, highest, rms}) => [
          name, {text: rank, className: "number"}, {text: tell.percent(share), className: "number"},
          {text: said.weights[verdict] || verdict, className: verdict},
          ...quantities.flatMap(quantity => [
            tell.cell(highest[quantity], quantity, `budget.${name}.${quantity}`),
            tell.cell(rms[quantity], quantity),
          ]),
        ]);
        const left = Object.entries(out).map(
          ([status, count]) => `${count}: ${words.statuses[status] || status}`).join(" ");
        host.replaceChildren(scrolling(tableOf(heads, cells), said.tabs.budget),
          element("p", {className: "caption"}, said.budget_caption,
            left ? ` ${filled(said.left_out, {why: left})}` : ""));
      },
    };
  },
};
