// Training subjects: the task at the start, how it stands, and the score at the end. What counts and what it comes to the module says.
import { tell } from "./screen.js";
import { ask, hear, wait } from "./simulator.js";

const element = (id) => document.getElementById(id);
/** Parts of a limit from which on it is shown as a warning, as in the program's window. */
const NEARLY = 0.8;

/** The task of the session that is open, if it is a subject's. */
let task = null;
/** Whether its reference does it, an instrument has moved, and its score was shown. */
let watched = false, hasBegun = false, scored = false;

const cell = (text) => Object.assign(document.createElement("td"), { textContent: text });

/** A measure by its name, with what it is. */
function measure({ title, definition }) {
  const told = cell(title);
  told.append(Object.assign(document.createElement("small"), { textContent: definition }));
  return told;
}

function rows(id, all, cells) {
  element(id).tBodies[0].replaceChildren(...all.map((one) => {
    const row = document.createElement("tr");
    row.append(...cells(one));
    return row;
  }));
}

/** Takes the task of a session that was opened, null of a scene; time goes on when it was read, or at once if it is not to be. */
export function open(now, isRead) {
  [task, watched, hasBegun, scored] = [now, false, false, false];
  element("score-dialog").close();
  element("standing").hidden = task === null;
  element("show-score").hidden = true;
  if (task && isRead) read();
  else wait(false);
}

function read() {
  wait(true);
  element("task-name").textContent = `${task.name} (level ${task.level})`;
  element("task-text").textContent = task.text;
  element("task-goal").textContent = task.goal;
  element("task-limits").textContent = task.limits.join(", ") || "nothing";
  rows("task-counts", task.counts, (one) => [measure(one), cell(one.asked), cell(one.points)]);
  // A script begins where the scene does.
  element("watch").hidden = hasBegun || task.exam;
  element("task-dialog").showModal();
}

/** Shows how it stands; the score as soon as it has ended. */
export function stand({ step, subject }) {
  hasBegun = step > 0;
  if (!task || !subject || scored) return;
  element("to-go").textContent = subject.to_go.join(", ");
  const list = element("used");
  while (list.children.length < subject.used.length) list.append(Object.assign(document.createElement("span"), { className: "used" }));
  while (list.children.length > subject.used.length) list.lastChild.remove();
  subject.used.forEach(({ what, value, limit, unit }, index) => {
    const chip = list.children[index];
    chip.textContent = `${what} ${value.toFixed(unit === "N" ? 3 : 1)} of ${limit} ${unit}`;
    chip.style.setProperty("--share", Math.min(1, value / limit));
    chip.classList.toggle("nearly", value > NEARLY * limit);
  });
  if (!subject.verdict) return;
  scored = true;
  const { passed, score: points } = subject.verdict;
  element("to-go").textContent = `${passed ? "passed" : "not passed"}, ${points.toFixed(0)} of 100; what is done now does not count`;
  hear("letGo");
  score();
}

async function score() {
  const told = await ask("score");
  if (!told?.ended) return;
  element("show-score").hidden = false;
  element("score-name").textContent = `${task.name} (level ${task.level})`;
  element("score-words").textContent = told.words;
  element("score-words").classList.toggle("passed", told.passed);
  element("score-watched").hidden = !watched;
  rows("score-asked", told.rows.filter((one) => one.asked !== null), (one) =>
    [cell(one.kept), measure(one), cell(one.value), cell(one.asked), cell(one.points)]);
  for (const row of element("score-asked").tBodies[0].rows) row.className = row.cells[0].textContent;
  rows("score-others", told.rows.filter((one) => one.asked === null), (one) => [measure(one), cell(one.value)]);
  element("task-dialog").close();
  element("score-dialog").showModal();
}

/** Makes the dialogs ready: `again` begins the subject once more, the others save its session and its report. */
export function prepare(again, saveSession, saveReport) {
  // A button that keeps the focus would be pressed by the pedal's key.
  for (const id of ["show-task", "show-score"]) element(id).addEventListener("click", ({ target }) => target.blur());
  element("show-task").addEventListener("click", read);
  element("show-score").addEventListener("click", score);
  element("task-dialog").addEventListener("close", () => wait(false));
  element("watch").addEventListener("click", () => {
    watched = true;
    tell("");
    ask("watch");
  });
  element("try-again").addEventListener("click", again);
  element("score-save").addEventListener("click", saveSession);
  element("score-report").addEventListener("click", saveReport);
}
