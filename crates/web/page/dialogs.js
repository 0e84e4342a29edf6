// Own vessels, devices and scenes, by a dialog or dropped on the page, and the help.
import { own, read, readText, write } from "./files.js";
import { DEVICES } from "./listed.js";
import * as screen from "./screen.js";
import { ask } from "./simulator.js";

const element = (id) => document.getElementById(id);
const TOMOGRAM = /\.(nii|nii\.gz|dcm)$/i;
const SURFACE = /\.(stl|obj|ply|vtp|vtk)$/i;
/** Pixels a side of the picture of a surface. */
const SIDE = 360;
/** A wire that fits most vessels. */
const USUAL = "devices/wire_035_hydrophilic_angled.toml";

let openScene, current;
/** The surface that is looked at. */
let surface = null;

export const help = () => element("help-dialog").open || element("help-dialog").showModal();

/** Fills the help with what the module says of keys. */
export function tables({ keyboard, gamepad }) {
  for (const [id, rows] of [["keys", keyboard], ["pad-keys", gamepad]]) {
    element(id).replaceChildren(...rows.map((row) => {
      const line = document.createElement("tr");
      line.append(...row.map((text) => Object.assign(document.createElement("td"), { textContent: text })));
      return line;
    }));
  }
}

/** A scene of a surface whose sheath is at an opening. */
function sceneOf({ name, unit, opening }, device) {
  return `name = ${JSON.stringify(name.replace(/\.[^.]*$/, "").replace(/[^\w -]/g, "_") || "own")}
seed = 1

[vessel]
file = ${JSON.stringify(name)}
unit_mm = ${unit}

[vessel.wall]
modulus_n_per_mm2 = 1.0
friction = 0.05

[device]
file = ${JSON.stringify(`../${device}`)}

[sheath]
opening = ${opening}
depth_mm = 2.0

[method]
name = "kirchhoff"
element_mm = 4.0

[view.xray]
contrast_fraction = 0.1   # contrast medium all the time, to see the vessel by
tissue_mm = 200.0
`;
}

async function look() {
  const told = element("vessel-error");
  element("survey").hidden = true;
  element("vessel-go").disabled = true;
  told.textContent = `${surface.name}: reading …`;
  surface.unit = Number(element("vessel-unit").value).toFixed(1);
  try {
    const { report, picture } = await ask("survey", { name: surface.name, bytes: surface.bytes, unit: Number(surface.unit), side: SIDE });
    told.textContent = "";
    const canvas = element("survey").querySelector("canvas");
    screen.paint(canvas, picture);
    const size = report.size_mm.map((mm) => mm.toFixed(0)).join(" × ");
    const lines = [`${report.triangles} triangles, ${size} mm, ${report.openings.length} openings`, ...report.notes, ...report.hints];
    element("hints").replaceChildren(...lines.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
    canvas.parentElement.querySelectorAll("button").forEach((button) => button.remove());
    const choose = (index) => {
      surface.opening = index;
      element("opening").textContent = index;
      for (const button of canvas.parentElement.querySelectorAll("button")) button.classList.toggle("on", button.textContent === String(index));
    };
    for (const { index, radius_mm, pixel } of report.openings.filter((one) => one.pixel)) {
      const button = Object.assign(document.createElement("button"), { type: "button", textContent: index, title: `radius ${radius_mm.toFixed(1)} mm` });
      Object.assign(button.style, { left: `${(100 * pixel[0]) / SIDE}%`, top: `${(100 * pixel[1]) / SIDE}%` });
      button.addEventListener("click", () => choose(index));
      canvas.parentElement.append(button);
    }
    if (report.inlet === null) {
      told.textContent = `${surface.name}: has no opening for a sheath: cut its ends off`;
    } else {
      choose(report.inlet);
      element("vessel-go").disabled = false;
    }
    element("survey").hidden = false;
  } catch (error) {
    told.textContent = error.message;
  }
}

async function takeSurface(file) {
  surface = { name: file.name, bytes: new Uint8Array(await file.arrayBuffer()), opening: 0 };
  if (!element("vessel-dialog").open) element("vessel-dialog").showModal();
  await look();
}

/** What the text dialog is for. */
let writing = null;

async function compose(title, about, list, path, go) {
  writing = go;
  element("text-title").textContent = title;
  element("text-about").textContent = about;
  element("text-choice").hidden = list.length === 0;
  element("text-list").replaceChildren(...list.map((one) => new Option(one.split("/").pop().replace(/\.toml$/, ""), one)));
  if (list.includes(path)) element("text-list").value = path;
  element("text-error").textContent = "";
  element("text").value = await readText(path);
  element("text-dialog").showModal();
}

/** Opens a text as a scene or a subject of its own. */
async function ownScene(text, folder = /^\s*\[goal\]/m.test(text) ? "subjects" : "scenes") {
  // Beside those of the page, whose paths it may have.
  const path = `${folder}/own.toml`;
  write(path, text);
  await openScene(path);
}

/** The device of a scene as a text to write in. */
async function device() {
  const path = current();
  if (path.startsWith("subjects/")) return screen.tell("a subject is the same for all: change `set` in its text", true);
  const names = await ask("missing", { files: new Map([[path, await read(path)]]), path });
  const file = names.find((name) => name.includes("devices/"));
  if (!file) return screen.tell("this scene says itself what its device is: change it in the scene's text", true);
  const plain = `devices/${file.split("/").pop()}`;
  return compose("Device", "The parts of a maker's data sheet, tip first, or sections. It takes the place of the scene's device.", DEVICES,
    DEVICES.includes(plain) ? plain : file, async (text) => {
      const before = own.get(file);
      write(file, text);
      try {
        await openScene(path);
      } catch (error) {
        if (before) own.set(file, before);
        else own.delete(file);
        throw error;
      }
    });
}

async function dropped(file) {
  if (SURFACE.test(file.name)) return takeSurface(file);
  if (TOMOGRAM.test(file.name)) throw new Error(`${file.name}: tomograms are read by the program alone`);
  const text = await file.text();
  // A file of script lines alone is one of the scene that is open.
  if (/^\s*\[\[script\]\]/m.test(text) && !/^\s*\[(vessel|sheath)\]/m.test(text)) return openScene(current(), text);
  return ownScene(text);
}

export function prepare(open, path) {
  [openScene, current] = [open, path];
  const warn = (error) => screen.tell(error.message, true, 30);
  element("help").addEventListener("click", help);
  element("own-vessel").addEventListener("click", () => element("vessel-dialog").showModal());
  element("own-device").addEventListener("click", () => device().catch(warn));
  element("own-scene").addEventListener("click", () =>
    compose("Scene as text", "Paths begin at the folder of the page's scenes.", [], current(), (text) => ownScene(text)).catch(warn));
  element("text-list").addEventListener("change", async ({ target }) => {
    element("text").value = await readText(target.value);
  });
  element("text-go").addEventListener("click", async (event) => {
    event.preventDefault();
    element("text-error").textContent = "opening …";
    try {
      await writing(element("text").value);
      element("text-dialog").close();
    } catch (error) {
      element("text-error").textContent = error.message;
    }
  });
  element("vessel-file").addEventListener("change", ({ target }) => target.files[0] && takeSurface(target.files[0]));
  element("vessel-unit").addEventListener("change", () => surface && look());
  element("vessel-device").append(...DEVICES.map((one) => new Option(one.split("/").pop().replace(/\.toml$/, ""), one, one === USUAL, one === USUAL)));
  element("vessel-go").addEventListener("click", async (event) => {
    event.preventDefault();
    element("vessel-error").textContent = "opening …";
    try {
      own.clear();
      own.set(`own/${surface.name}`, surface.bytes);
      await ownScene(sceneOf(surface, element("vessel-device").value), "own");
      element("vessel-dialog").close();
    } catch (error) {
      element("vessel-error").textContent = error.message;
    }
  });
  const cover = element("drop");
  addEventListener("dragover", (event) => {
    event.preventDefault();
    cover.hidden = false;
  });
  addEventListener("dragleave", (event) => event.relatedTarget || (cover.hidden = true));
  addEventListener("drop", (event) => {
    event.preventDefault();
    cover.hidden = true;
    const [file] = event.dataTransfer.files;
    if (file) dropped(file).catch(warn);
  });
}
