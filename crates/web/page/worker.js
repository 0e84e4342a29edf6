// The session on a clock, beside the page: physics sixty times a second, pictures when there is time for them.
import init, { Graphics, Session, Surface, fittingSide, keys, missingFiles } from "./pkg/endowire.js";

const TICK_MS = 1000 / 60;
const FRAME_MS = 1000 / 30;
/** Beyond this the clock has been stopped, and what was missed is not made up for. */
const LATE_MS = 100;
/** The 3D view is drawn each so many frames: it helps, and the live picture leads. */
const THREE_D_EVERY = 4;
/** How often the size of pictures is chosen anew, and from how many live frames of that size. */
const FIT_MS = 3000, FIT_FRAMES = 20;

let session, memory;
let due = 0, frameDue = 0, frames = 0, ticks = 0, live = 0, wasLive = false;
/** Whether the page has shown the last frame: more are not made than it can show. */
let shown = true;
/** When the oldest input came in that no picture shows. */
let inputAt = null;
let hidden = false, waits = false, stopped = false, choosing = false;
/** Side of the pictures, how large they are shown, and the quickest of the live frames of that side since it was chosen. */
let side = 0, shownPx = 0, fit = { at: 0, frames: 0, ms: Infinity };
let counted = { at: performance.now(), ticks: 0, live: 0 };

/** The graphics processor, where the browser has one. */
let graphics = null;
/** How long the processor took for its first 3D view, and whether the graphics processor is quicker: null until that was measured. */
let firstMs = null, isQuicker = null;

const started = init().then(async (exports) => {
  memory = exports.memory;
  if (navigator.gpu) graphics = await Graphics.open().catch(() => null);
  postMessage({ started: keys() });
});

/** What a panic has told; the module is of no use after one. */
let panicked = "";
const told = console.error;
console.error = (...text) => { panicked = text.join(" "); told(...text); };

/** Does something with the session; what the module refuses is told, and where it has broken down it stops. */
function guarded(work) {
  if (stopped) return undefined;
  try {
    return work();
  } catch (error) {
    if (error instanceof WebAssembly.RuntimeError) {
      stopped = true;
      postMessage({ broken: panicked || String(error) });
    } else {
      postMessage({ failed: error.message ?? String(error) });
    }
    return undefined;
  }
}

function physics(until) {
  const now = performance.now();
  if (now - due > LATE_MS) due = now;
  while (due <= performance.now() && performance.now() < until) {
    session.tick();
    ticks += 1;
    due += TICK_MS;
  }
}

/** Has the graphics processor draw from now on where its 3D view takes less time than the processor's first: software may imitate one. */
async function choose(one) {
  let lastMs = Infinity;
  // The first has the shaders compiled.
  for (let time = 0; time < 2 && one === session; time++) {
    one.draw3DBy(graphics);
    const begun = performance.now();
    while (one === session && !one.threeD()) await new Promise((resolve) => setTimeout(resolve, 1));
    lastMs = performance.now() - begun;
  }
  if (one !== session) return null;
  // One that has failed has been left.
  const draws = one.backend3D() === graphics.name && lastMs < firstMs;
  if (draws) one.useGraphics(graphics);
  else one.draw3DHere();
  return draws;
}

/** Has pictures drawn as large as they are shown, if there is time. */
function chooseSide(ms) {
  fit.frames += 1;
  fit.ms = Math.min(fit.ms, ms);
  if (fit.frames < FIT_FRAMES || performance.now() - fit.at < FIT_MS || shownPx === 0) return;
  const fitting = fittingSide(shownPx, side, fit.ms);
  fit = { at: performance.now(), frames: 0, ms: Infinity };
  if (fitting !== side) {
    side = fitting;
    session.showAt(side);
  }
}

/** The 3D view, if it is time for one: that of the graphics processor is drawn meanwhile, and fetched as soon as it is there. */
function three() {
  if (choosing || (!isQuicker && frames % THREE_D_EVERY !== 0)) return null;
  const begun = performance.now();
  const picture = session.threeD() ?? null;
  if (!graphics || isQuicker !== null || !picture) return picture;
  firstMs = performance.now() - begun;
  choosing = true;
  const done = (result) => {
    choosing = false;
    isQuicker = result;
  };
  choose(session).then(done, (error) => {
    done(false);
    guarded(() => { throw error; });
  });
  return picture;
}

function draw() {
  const readout = session.readout();
  const frame = { readout, inputAt, planes: [], three: null, backend: session.backend(), backend3D: session.backend3D() };
  const isLive = readout.lab.live;
  const begun = performance.now();
  if (isLive || wasLive) frame.planes = session.fluoroSoon();
  if (isLive && frame.planes[0]?.width === side) chooseSide(performance.now() - begun);
  if (isLive) live += 1;
  wasLive = isLive;
  if (isQuicker && frame.backend3D !== graphics.name) isQuicker = false;
  frame.three = three();
  frames += 1;
  inputAt = null;
  shown = false;
  postMessage({ frame }, [...frame.planes, ...(frame.three ? [frame.three] : [])].map((one) => one.data.buffer));
  if (isLive) session.sharpen();
}

function pace(now) {
  if (now - counted.at < 1000) return;
  const seconds = (now - counted.at) / 1000;
  postMessage({
    pace: { ticks: (ticks - counted.ticks) / seconds, frames: (live - counted.live) / seconds, mib: memory.buffer.byteLength / 2 ** 20 },
  });
  counted = { at: now, ticks, live };
}

function turn() {
  if (session && !hidden) {
    guarded(() => {
      if (waits) due = performance.now() + FRAME_MS;
      else physics(performance.now() + FRAME_MS);
      const now = performance.now();
      if (shown && now >= frameDue) {
        frameDue = Math.max(frameDue + FRAME_MS, now - FRAME_MS);
        draw();
      }
      pace(now);
    });
  }
  const next = hidden || !session ? performance.now() + FRAME_MS : Math.min(due, shown ? frameDue : Infinity);
  setTimeout(turn, Math.max(0, next - performance.now()));
}
turn();

/** What the page asks for; each answer goes back under its name. */
const asked = {
  async open({ files, path, side: asked }) {
    const made = new Session(files, path, asked);
    side = asked;
    fit = { at: performance.now(), frames: 0, ms: Infinity };
    session?.free();
    session = made;
    if (isQuicker) {
      session.useGraphics(graphics);
      session.draw3DBy(graphics);
    }
    due = frameDue = performance.now();
    frames = 0;
    wasLive = false;
    // The link of a session begins where it ends.
    if (files.has("script.toml")) session.apply({ do: "script" });
    const task = session.task();
    // Who is tested reads the task first.
    waits = task !== null;
    return task;
  },
  /** Has the subject done by its reference, under the beam, as `endowire subject run` does it. */
  watch() {
    session = session.watched();
    // By its key, which is pressed once more to end it.
    session.key("Enter", true, false);
    session.key("Enter", false, false);
    session.apply({ do: "script" });
  },
  missing: ({ files, path }) => missingFiles(files, path),
  score: () => session?.score() ?? null,
  sessionFile: ({ folder }) => session?.sessionFile(folder, Date.now() / 1000) ?? "",
  report: ({ frames }) => session?.report(frames) ?? "",
  scriptHead: ({ folder }) => session?.scriptHead(folder, "played.toml") ?? "",
  script: () => session?.script() ?? "",
  record: () => session?.record() ?? null,
  positions: () => session?.positions() ?? new Float64Array(),
  survey({ name, bytes, unit, side }) {
    const surface = new Surface(name, bytes, unit, side);
    const answer = { report: surface.report(), picture: surface.picture() };
    surface.free();
    return answer;
  },
};

const heard = {
  key: ([code, down, again]) => session.key(code, down, again),
  modify: ([shift, control]) => session.modify(shift, control),
  letGo: () => session.letGo(),
  gamepad: ([pressed, up, right, bend]) => session.gamepad(pressed, up, right, bend),
  input: (input) => session.apply(input),
};

onmessage = async ({ data }) => {
  await started;
  if (data.shown) {
    shown = true;
  } else if (data.hidden !== undefined) {
    hidden = data.hidden;
    due = frameDue = performance.now();
    shown = true;
  } else if (data.shownPx !== undefined) {
    shownPx = data.shownPx;
  } else if (data.waits !== undefined) {
    waits = data.waits;
  } else if (data.ask) {
    try {
      if (stopped) throw new Error("the simulator has stopped: load the page again");
      postMessage({ answer: await asked[data.ask](data.with ?? {}), to: data.id });
    } catch (error) {
      if (error instanceof WebAssembly.RuntimeError) {
        stopped = true;
        postMessage({ broken: panicked || String(error) });
      }
      postMessage({ refused: error.message ?? String(error), to: data.id });
    }
  } else if (session) {
    inputAt ??= data.at;
    // What is refused is an event of the session, which the readout tells.
    try {
      heard[data.hear](data.what);
    } catch (error) {
      if (error instanceof WebAssembly.RuntimeError) guarded(() => { throw error; });
    }
  }
};
