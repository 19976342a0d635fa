// What takes longer than a slider's step: the machine farthest off that is found, the proven bound,
// and machines drawn at random, in parts that grow. What is asked anew drops what is under way.

const COMMANDS = ["nominal", "corrected"];
const PARTS = [500, 1500, 8000, 40000];
const LARGEST_PART = 50000, SAMPLES = 500000;
const SEED = 0;

let ask, machine, bundle = null, latest = null, working = false;

const pause = () => new Promise(done => setTimeout(done));

onmessage = async ({data}) => {
  if (data.module) ask = await kernelOf(data.module);
  else if (data.bundle) [bundle, latest] = [data.bundle, null];
  else latest = data;
  if (ask && latest && !working) work();
};

async function work() {
  working = true;
  while (latest) {
    const job = latest;
    latest = null;
    const runs = [];
    try {
      takeMachine();
      for (const told of steps(job, runs)) {
        postMessage({id: job.id, ...told});
        await pause();
        if (latest || bundle) break;
      }
    } catch (failure) {
      postMessage({id: job.id, failed: failure.message});
    }
    for (const run of runs) ask({op: "free", run});
  }
  working = false;
}

// The machine of the bundle that was told last, in place of the one before.
function takeMachine() {
  if (!bundle) return;
  if (machine !== undefined) ask({op: "free", machine});
  ({machine} = ask({op: "machine", bundle}));
  bundle = null;
}

// What is told of a job, one after the other.
function* steps(job, runs) {
  if (job.nothing) return;
  const asked = {machine, pose: job.pose, condition: job.condition, scale: job.scale};
  for (const op of ["worst", "bounds"]) {
    for (const command of COMMANDS) {
      yield {command, [op]: answered({...asked, op, command})};
    }
  }
  const drawn = {};
  for (const command of COMMANDS) {
    const {run} = answered({...asked, op: "samples", command, seed: SEED});
    if (run === undefined) continue;
    drawn[command] = run;
    runs.push(run);
  }
  let first = 0;
  for (let part = 0; first < SAMPLES; part++) {
    const count = Math.min(PARTS[part] || LARGEST_PART, SAMPLES - first);
    for (const [command, run] of Object.entries(drawn)) {
      ask({op: "more", run, first, count});
      const read = ask({op: "read", run, probabilities: job.probabilities});
      yield {command, samples: read, done: first + count >= SAMPLES};
    }
    first += count;
  }
}

// What is answered, or the code of why nothing is, as a status.
function answered(request) {
  try {
    return ask(request);
  } catch (failure) {
    if (failure instanceof KernelError) return {status: failure.code};
    throw failure;
  }
}
