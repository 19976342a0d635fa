// The kernel that the command line runs, compiled to WebAssembly: it is asked in JSON and answers
// in JSON. Page and worker both have it.

class KernelError extends Error {
  constructor({code, message, place}) {
    super(place ? `${message} (${place})` : message);
    this.code = code;
  }
}

// A module of base64 of gzip's form, compiled while it is unpacked.
function compiledModule(text) {
  const letters = atob(text), bytes = new Uint8Array(letters.length);
  for (let at = 0; at < bytes.length; at++) bytes[at] = letters.charCodeAt(at);
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
