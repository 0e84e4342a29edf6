// The page: scenes in, sessions out.
import * as dialogs from "./dialogs.js";
import { filesOf, ofFragment, own, save, toFragment, write } from "./files.js";
import * as hands from "./hands.js";
import { SUBJECTS } from "./listed.js";
import { SCENES } from "./scenes.js";
import * as screen from "./screen.js";
import { ask, hear, hide, on, shown, shownAs, started } from "./simulator.js";
import * as training from "./training.js";

/** Pixels a side of the first pictures: later ones are as large as they are shown, if there is time. */
const SIDE = 384;
/** Longest link that common programs pass on, characters. */
const LONGEST_LINK = 30000;

const element = (id) => document.getElementById(id);
/** The scene that is open. */
let open = { path: "", name: "" };

/** Opens a scene or a subject, with a script in place of its own if one is given; the task of a subject. */
async function load(path, script) {
  screen.tell("opening …", false, 60);
  const files = await filesOf(path, script);
  const task = await ask("open", { files, path, side: SIDE });
  screen.clear();
  open = { path, name: path.split("/").pop().replace(/\.toml$/, "") };
  document.title = `endowire: ${open.name}`;
  const menu = element("scenes");
  menu.querySelector("[value=own]")?.remove();
  if (own.has(path)) menu.prepend(new Option("Own scene", "own"));
  menu.value = own.has(path) ? "own" : path;
  const how = matchMedia("(pointer: coarse)").matches ? "drag the round field up to push, sideways to turn" : "push with ↑ or the round field; F1 shows all keys";
  screen.tell(script ? "" : how);
  return task;
}

/** The same for who sees it for the first time: a task is read, unless a script shows what was done. What is wrong goes to who asked. */
export const openScene = async (path, script) => training.open(await load(path, script), !script);

/** The same where nobody waits: what is wrong is told on the page. */
const tryScene = (path, script) => openScene(path, script).catch((error) => screen.tell(error.message, true, 60));

/** Begins the scene once more, at once. */
const again = () => load(open.path).then((task) => training.open(task, false), (error) => screen.tell(error.message, true, 60));

let inputsMs = [];
on.frame = (frame) => {
  screen.show(frame);
  training.stand(frame.readout);
  if (frame.inputAt !== null) inputsMs.push(performance.now() - frame.inputAt);
  shown();
};
on.pace = (pace) => {
  screen.pace(pace, inputsMs);
  if (inputsMs.length > 200) inputsMs = inputsMs.slice(-100);
};
on.failed = (text) => screen.tell(text, true);
on.broken = (text) => screen.tell(`the simulator has stopped, load the page again: ${text}`, true, 1e6);

/** Where the scene's file is for the program: own ones are wherever they come from. */
const folder = () => ({ folder: own.has(open.path) ? "" : "assets" });

const saveScript = async () => save("played.toml", await ask("scriptHead", folder()) + await ask("script"), "text/plain");
const saveSession = async () => save("played.session.json", await ask("sessionFile", folder()), "application/json");

async function saveTable() {
  const { samples } = await ask("record");
  const names = screen.readout.instruments.map((one) => one.name);
  const head = ["time_s", "tip_x_mm", "tip_y_mm", "tip_z_mm", "wall_force_n", "tip_force_n"];
  const felt = names.flatMap((name) => ["inserted_mm", "push_force_n", "torque_nmm"].map((what) => `${name}_${what}`));
  const rows = samples.map(({ time_s, tip_mm, wall_force_n, tip_force_n, hands: held }) =>
    [time_s, ...(tip_mm ?? ["", "", ""]), wall_force_n, tip_force_n,
      ...held.flatMap((hand) => [hand.inserted_mm, hand.push_force_n ?? "", hand.torque_nmm])].join(","));
  save(`${open.name}.csv`, [[...head, ...felt].join(","), ...rows, ""].join("\n"), "text/csv");
}

/** The views that are there. */
const views = () => [screen.fluoro, screen.second, screen.three].filter((canvas) => !canvas.parentElement.hidden);

async function savePicture() {
  const pictures = views();
  const whole = document.createElement("canvas");
  // Of a room that has just changed there is a coarse picture.
  const side = Math.max(...pictures.map((one) => one.height));
  [whole.width, whole.height] = [side * pictures.length, side];
  const context = whole.getContext("2d");
  pictures.forEach((one, number) => context.drawImage(one, number * side, 0, side, side));
  whole.toBlob((blob) => save(`${open.name}.png`, blob));
}

async function saveReport() {
  const frames = views().map((canvas) => ({ view: canvas.parentElement.id, png: canvas.toDataURL("image/png").split(",")[1] }));
  await ask("report", { frames }).then((page) => save(`${open.name}.html`, page, "text/html"), (error) => screen.tell(error.message, true));
}

async function share() {
  if ([...own.keys()].some((path) => !path.endsWith(".toml"))) {
    return screen.tell("a link has no room for an own surface: save the script, and give both", true);
  }
  const texts = Object.fromEntries([...own].map(([path, bytes]) => [path, new TextDecoder().decode(bytes)]));
  const link = `${location.href.split("#")[0]}#s=${await toFragment({ path: open.path, own: texts, script: await ask("script") })}`;
  if (link.length > LONGEST_LINK) return screen.tell("too much was done for a link: save the script instead", true);
  history.replaceState(null, "", link);
  await navigator.clipboard?.writeText(link).catch(() => {});
  return screen.tell("the link is in the address line and on the clipboard; scene and script are in it, and on no server");
}

/** Opens what the address says. */
async function begin() {
  own.clear();
  const fragment = new URLSearchParams(location.hash.slice(1));
  if (!fragment.has("s")) return tryScene(fragment.get("scene") ?? SCENES[0][0]);
  try {
    const { path, own: texts, script } = await ofFragment(fragment.get("s"));
    for (const [name, text] of Object.entries(texts)) write(name, text);
    return tryScene(path, script);
  } catch {
    screen.tell("this link is damaged: its scene cannot be read", true, 60);
    return tryScene(SCENES[0][0]);
  }
}

for (const [label, options] of [
  ["Scenes", SCENES.map(([path, title]) => new Option(title, path))],
  ["Training subjects, by level", SUBJECTS.map(([path, title, level]) => new Option(`${level} · ${title}`, path))],
]) {
  const group = Object.assign(document.createElement("optgroup"), { label });
  group.append(...options);
  element("scenes").append(group);
}
element("scenes").addEventListener("change", ({ target }) => {
  target.blur();
  own.clear();
  history.replaceState(null, "", `#scene=${target.value}`);
  tryScene(target.value);
});
element("again").addEventListener("click", again);
element("save-script").addEventListener("click", saveScript);
element("save-session").addEventListener("click", saveSession);
element("save-table").addEventListener("click", saveTable);
element("save-picture").addEventListener("click", savePicture);
element("save-report").addEventListener("click", saveReport);
element("share").addEventListener("click", share);
for (const button of document.querySelectorAll("nav button")) button.addEventListener("click", () => button.blur());

dialogs.prepare(openScene, () => open.path);
training.prepare(again, saveSession, saveReport);
hands.buttons();
hands.field(element("hand"), element("knob"));
hands.gamepad();
hands.views(screen.fluoro, screen.second, screen.three, () => screen.readout?.lab.field_mm ?? 0);
hands.keyboard(() => dialogs.help());
new ResizeObserver(() => shownAs(Math.round(screen.fluoro.clientWidth * devicePixelRatio))).observe(screen.fluoro);
addEventListener("hashchange", begin);
document.addEventListener("visibilitychange", () => {
  if (document.hidden) hear("letGo");
  hide(document.hidden);
});

started.then((tables) => {
  dialogs.tables(tables);
  return begin();
}).catch((error) => screen.tell(error.message, true, 1e6));
navigator.serviceWorker?.register("sw.js", { type: "module" }).catch(() => {});
