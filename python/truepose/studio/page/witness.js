// The witness of the verdict, one machine inside the bands, drawn at its pose over the nominal one, in
// place of what is known.

// `part`: a function, the live part; its body is another one where the machine's form is.
function witnessDrawing(place, {words, said, tell, part, go}) {
  const states = {before: words.as_commanded, after: words.compensated};
  const find = name => place.querySelector(`[data-live="${name}"]`);
  const keyOf = ({state, quantity}) => `${ANSWERED[state]}.${quantity}`;
  let answers = new Map(), chosen = "";

  // What is drawn of an answer, always the same object, and null of none.
  const drawnOf = ({witness: {pose}, example: {centres, moved}}) => ({pose, centres, moved});

  // Answers that have a machine to be drawn; of a choice that is not among them comes more, or nothing.
  function take(value) {
    answers = new Map(value.filter(({example}) => example && example.centres).map(
      answer => [keyOf(answer), {...answer, drawn: drawnOf(answer)}]));
    const isWhole = Object.keys(ANSWERED).every(state => value.some(answer => answer.state === state));
    if (isWhole && !answers.has(chosen)) chosen = "";
    again();
  }

  function again() {
    const select = find("drawn");
    if (!select) return;
    const options = [...answers].map(([key, {state, quantity}]) => element("option", {value: key},
      filled(said.drawn_witness, {state: states[ANSWERED[state]], quantity: tell.quantity(quantity)})));
    select.replaceChildren(element("option", {value: ""}, said.drawn_known), ...options);
    draw();
  }

  function draw() {
    const answer = answers.get(chosen) || null;
    find("drawn").value = answer ? chosen : "";
    find("witness").replaceChildren(...(answer ? wordsOf(answer) : []));
    if (part()) part().overlay(answer && answer.drawn);
  }

  function wordsOf({quantity, witness, example}) {
    const size = tell.cell(witness.value, quantity).text;
    return [
      element("p", {className: "there"}, element("i"), " ", filled(said.drawn_there, {size})),
      element("p", {className: "elsewhere"}, `${said.drawn_elsewhere} `, tell.goTo(witness.pose)),
      element("ul", {}, ...example.causes.map(cause => element("li", {}, cause))),
    ];
  }

  function choose(answer) {
    chosen = answer ? keyOf(answer) : "";
    draw();
    if (answer) go(answer.witness.pose);
  }

  place.addEventListener("change", ({target}) => {
    if (target.dataset.live === "drawn") choose(answers.get(target.value) || null);
  });

  return {take, again, choose, stale: () => { answers = new Map(); again(); }};
}
