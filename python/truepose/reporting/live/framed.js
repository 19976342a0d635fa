// A page in a frame of another page, which cannot look into it: it says how high it is, and nothing else.

function startFramed() {
  const tell = () => parent.postMessage({trueposeHeight: Math.ceil(document.body.getBoundingClientRect().height)}, "*");
  new ResizeObserver(tell).observe(document.body);
  return startLive();
}
