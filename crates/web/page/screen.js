// What is on the screen: pictures, read-outs, what has happened.
import { hear } from "./simulator.js";

const element = (id) => document.getElementById(id);
const canvases = ["fluoro", "second", "three"].map((id) => element(id).querySelector("canvas"));
export const [fluoro, second, three] = canvases;

/** The last readout. */
export let readout = null;

/** Puts a picture into a canvas. */
export function paint(canvas, { width, height, data }) {
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  canvas.getContext("2d").putImageData(new ImageData(data, width, height), 0, 0);
}

const side = (deg, names) => (Math.abs(deg) < 0.05 ? "" : `${names[deg < 0 ? 1 : 0]} ${Math.abs(deg).toFixed(0)}°`);
const pose = (lao, cra) => [side(lao, ["LAO", "RAO"]), side(cra, ["CRA", "CAU"])].filter(Boolean).join(" ") || "AP";
const modes = { fluoro: "fluoroscopy", cine: "cine", dsa: "DSA", roadmap: "roadmap" };
const minutes = (s) => `${Math.floor(s / 60)}:${(s % 60).toFixed(1).padStart(4, "0")}`;

/** A minus that is one, and none before zero. */
const minus = (text) => text.replace(/^-(?=[0.]*$)/, "").replace("-", "−");
const newtons = (n) => (Math.abs(n) < 0.1 ? `${minus((1000 * n).toFixed(1))}\u00a0mN` : `${minus(n.toFixed(2))}\u00a0N`);

/** The value to which a tip is steered, with its sign; nothing for those that are not. */
function bend(value) {
  if (value === undefined) return "";
  const text = minus(value.toFixed(2));
  return `, tip ${Number(text) === 0 ? "straight" : text.replace(/^(?=\d)/, "+")}`;
}

/** Shows a frame. */
export function show({ readout: now, planes, three: view, backend, backend3D }) {
  readout = now;
  if (planes[0]) {
    paint(fluoro, planes[0]);
    element("call").hidden = true;
  }
  if (planes[1]) paint(second, planes[1]);
  if (view) paint(three, view);
  const { lab } = now;
  element("fluoro").classList.toggle("live", lab.live);
  element("second").classList.toggle("live", lab.live);
  element("second").hidden = !lab.second_deg;
  element("views").classList.toggle("biplane", Boolean(lab.second_deg));
  element("lock").classList.toggle("on", lab.live);
  element("show").classList.toggle("on", now.demonstrates);
  element("detach").hidden = !now.packing;
  element("steering").hidden = !now.instruments.some((one) => one.steer !== undefined);
  element("arm").textContent = pose(lab.lao_deg, lab.cra_deg);
  if (lab.second_deg) element("second-arm").textContent = pose(...lab.second_deg);
  element("beam").textContent = `${lab.live ? `${modes[lab.mode]} live` : "beam off"}\n${minutes(lab.beam_s)}  ${lab.entrance_ugy === null ? "" : `${(lab.entrance_ugy / 1000).toFixed(2)} mGy, ${lab.kerma_area_ugym2.toFixed(1)} µGy·m²`}`;
  element("field").textContent = `${lab.field_mm.toFixed(0)} mm`;
  element("backend").textContent = backend === backend3D ? `pictures by ${backend}` : [backend && `fluoroscopy by ${backend}`, `3D by ${backend3D}`].filter(Boolean).join(", ");
  idle(now.idle_keys);
  hands(now);
  happened(now);
}

let idleNow = "";

/** Shows which buttons would do nothing now, and why. */
function idle(keys) {
  const text = JSON.stringify(keys);
  if (text === idleNow) return;
  idleNow = text;
  for (const button of document.querySelectorAll("[data-code], [data-hold]")) {
    const code = button.dataset.code ?? button.dataset.hold;
    const found = keys.find((key) => key.code === code && key.shift === ("shift" in button.dataset));
    button.classList.toggle("idle", Boolean(found));
    button.setAttribute("aria-disabled", Boolean(found));
    button.title = found?.why ?? "";
  }
}

function hands(now) {
  const list = element("instruments");
  if (list.children.length !== now.instruments.length) {
    list.replaceChildren(...now.instruments.map((one) => {
      const button = document.createElement("button");
      button.className = "instrument";
      button.append(...["b", "span", "span"].map((tag) => document.createElement(tag)));
      button.lastChild.className = "felt";
      button.addEventListener("click", () => {
        hear("key", [`Digit${[...list.children].indexOf(button) + 1}`, true, false]);
        button.blur();
      });
      return button;
    }));
  }
  now.instruments.forEach((one, index) => {
    const button = list.children[index];
    const push = one.push_force_n === null ? "–" : newtons(one.push_force_n);
    const [name, place, felt] = button.children;
    name.textContent = one.name;
    const ahead = Math.abs(one.behind_mm) < 0.05 ? "" : `, hand ${minus(one.behind_mm.toFixed(1))} mm ahead`;
    place.textContent = `${one.inserted_mm.toFixed(1)} mm in${ahead}, ${minus(one.rotation_deg.toFixed(0))}°${bend(one.steer)}`;
    felt.textContent = `push ${push}, torque ${minus(one.torque_nmm.toFixed(2))}\u00a0N·mm${one.warns ? " – beyond the limit" : ""}`;
    button.classList.toggle("warns", one.warns);
    button.classList.toggle("chosen", now.selected === one.name && now.instruments.length > 1);
  });
}

/** What is told until something else is. */
let notice = { text: "", warns: false, until: 0 };

/** Tells something for some seconds. */
export function tell(text, warns = false, seconds = 8) {
  notice = { text, warns, until: performance.now() + 1000 * seconds };
  place(notice);
}

function place({ text, warns }) {
  const line = element("told");
  if (line.textContent !== text) line.textContent = text;
  line.classList.toggle("warn", warns);
}

function happened(now) {
  const recent = now.event && now.time_s - now.event.time_s < 6;
  if (recent) return place({ text: now.event.text, warns: true });
  if (notice.text && performance.now() < notice.until) return place(notice);
  const sac = now.packing ? `, sac ${(100 * now.packing.density).toFixed(1)} % full` : "";
  const contacts = `${now.contacts} contacts, ${newtons(now.wall_force_n)} in all${sac}`;
  place({ text: now.demonstrates ? "the script is shown: move to take over" : `step ${now.step}, ${contacts}`, warns: false });
}

/** Shows how fast it goes; numbers for those who measure are attributes. */
export function pace({ ticks, frames, mib }, inputsMs) {
  const sorted = inputsMs.toSorted((a, b) => a - b);
  const median = sorted[Math.floor(sorted.length / 2)];
  const line = element("pace");
  const wait = median === undefined ? "" : `, ${median.toFixed(0)} ms from hand to picture`;
  line.textContent = `${ticks.toFixed(0)} ticks and ${frames.toFixed(0)} live frames a second${wait}, ${mib.toFixed(0)} MiB`;
  Object.assign(line.dataset, { ticks, frames, mib, inputMs: median ?? "" });
}

/** Forgets the pictures of the session before. */
export function clear() {
  for (const canvas of canvases) canvas.getContext("2d").clearRect(0, 0, canvas.width, canvas.height);
  element("call").hidden = false;
  element("instruments").replaceChildren();
}
