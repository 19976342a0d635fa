// Answers requests, a line of JSON each, with the module whose gzipped file is named; `memory` is its size.
import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
import { gunzipSync } from "node:zlib";

const { instance } = await WebAssembly.instantiate(gunzipSync(readFileSync(process.argv[2])), {});
const { room, answer, reply_length: replyLength, memory } = instance.exports;

function ask(request) {
  const bytes = Buffer.from(request, "utf8");
  const at = room(bytes.length);
  if (at === 0) return '{"error":{"code":"too-long"}}';
  new Uint8Array(memory.buffer, at, bytes.length).set(bytes);
  const reply = answer(bytes.length);
  return Buffer.from(memory.buffer, reply, replyLength()).toString("utf8");
}

function answered(line) {
  if (line === "memory") return String(memory.buffer.byteLength);
  // "* N REQUEST" asks N times: what is to be done often. The last reply counts.
  const times = /^\* (\d+) /.exec(line);
  if (times === null) return ask(line);
  const request = line.slice(times[0].length);
  for (let done = 1; done < Number(times[1]); done += 1) ask(request);
  return ask(request);
}

for await (const line of createInterface({ input: process.stdin })) {
  process.stdout.write(`${answered(line)}\n`);
}
