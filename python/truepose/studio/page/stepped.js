// A number in a text, stepped in its last digit.

const NUMBERS = /(?<![\w."'])[+\u2212-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?/g;

// The number at a place of a text, or nearest to it: {from, to}; null where there is none.
function numberAt(text, place) {
  let nearest = null, least = Infinity;
  for (const {0: number, index} of text.matchAll(NUMBERS)) {
    const to = index + number.length, away = Math.max(index - place, place - to, 0);
    if (away < least) [nearest, least] = [{from: index, to}, away];
  }
  return nearest;
}

// The text with that number `by` of its last digit larger, and where it stands then.
function stepped(text, place, by) {
  const there = numberAt(text, place);
  if (!there) return null;
  const [mantissa, power = ""] = text.slice(there.from, there.to).split(/(?=[eE])/);
  const decimals = (mantissa.split(".")[1] || "").length, scale = 10 ** decimals;
  const value = (Math.round(Number(mantissa.replace("\u2212", "-")) * scale) + by) / scale;
  const plus = mantissa.startsWith("+") && value > 0 ? "+" : "";
  const number = plus + (value === 0 ? 0 : value).toFixed(decimals) + power;
  return {
    text: text.slice(0, there.from) + number + text.slice(there.to),
    from: there.from, to: there.from + number.length,
  };
}
