// The worker as functions: asks that are answered, inputs that are heard, and frames that come by themselves.

const worker = new Worker("worker.js", { type: "module" });
const waiting = new Map();
let asks = 0;

/** Listeners: `frame`, `pace`, `failed`, `broken`. */
export const on = {};

/** Tables of keys, once the module is there. */
export const started = new Promise((resolve, reject) => {
  worker.addEventListener("message", ({ data }) => {
    if (data.started) resolve(data.started);
  });
  worker.addEventListener("error", (event) => {
    const text = event.message ?? "the simulator cannot be loaded";
    reject(new Error(text));
    on.broken?.(text);
  });
});

worker.addEventListener("message", ({ data }) => {
  if (data.to !== undefined) {
    const { resolve, reject } = waiting.get(data.to);
    waiting.delete(data.to);
    if (data.refused === undefined) resolve(data.answer);
    else reject(new Error(data.refused));
    return;
  }
  for (const [name, what] of Object.entries(data)) on[name]?.(what);
});

/** Asks the worker for something. */
export function ask(what, details) {
  return new Promise((resolve, reject) => {
    const id = asks++;
    waiting.set(id, { resolve, reject });
    worker.postMessage({ ask: what, with: details, id });
  });
}

/** Has the session hear a hand. */
export function hear(name, what) {
  worker.postMessage({ hear: name, what, at: performance.now() });
}

/** Says that the last frame is on the screen. */
export const shown = () => worker.postMessage({ shown: true });

/** Has time stand still while nobody looks. */
export const hide = (hidden) => worker.postMessage({ hidden });

/** Says how large the live picture is shown, in pixels of the screen. */
export const shownAs = (shownPx) => worker.postMessage({ shownPx });

/** Has time stand still while something is read; pictures go on. */
export const wait = (waits) => worker.postMessage({ waits });
