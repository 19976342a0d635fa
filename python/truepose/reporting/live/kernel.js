// The kernel that the command line runs, compiled to WebAssembly: it is asked in JSON and answers
// in JSON. Page and worker both have it.

class KernelError extends Error {
  constructor({code, message, place}) {
    super(place ? `${message} (${place})` : message);
    this.code = code;
  }
}

// The letters of base85 as part.py writes it: each five are four bytes.
const LETTERS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;.=>?@^_`{|}~";

function bytesOf(text) {
  const values = new Uint8Array(128), lacking = (5 - text.length % 5) % 5;
  for (let at = 0; at < LETTERS.length; at++) values[LETTERS.charCodeAt(at)] = at;
  const whole = text + "~".repeat(lacking), bytes = new Uint8Array(whole.length / 5 * 4);
  const view = new DataView(bytes.buffer);
  for (let from = 0, to = 0; from < whole.length; to += 4) {
    let value = 0;
    for (const end = from + 5; from < end; from++) value = value * 85 + values[whole.charCodeAt(from)];
    view.setUint32(to, value);
  }
  return bytes.subarray(0, bytes.length - lacking);
}

// A module of base85 of gzip's form, compiled while it is unpacked.
function compiledModule(text) {
  const bytes = bytesOf(text);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const headers = {"Content-Type": "application/wasm"};
  return WebAssembly.compileStreaming(new Response(stream, {headers}));
}

// A function: a request -> what is answered. Throws `KernelError` where the kernel refuses.
async function kernelOf(module) {
  const {exports} = await WebAssembly.instantiate(module, {});
  const encoder = new TextEncoder(), decoder = new TextDecoder();
  return request => {
    const bytes = encoder.encode(JSON.stringify(request));
    const room = exports.room(bytes.length);
    new Uint8Array(exports.memory.buffer).set(bytes, room);
    const at = exports.answer(bytes.length);
    const reply = new Uint8Array(exports.memory.buffer, at, exports.reply_length());
    const {ok, error} = JSON.parse(decoder.decode(reply));
    if (error) throw new KernelError(error);
    return ok;
  };
}
