// The page: courses, and one attempt at a time.
const drawings = [];

function redraw() { roadmap.draw(); timeline.draw(); }

function noticed(attempt) {
  const body = at("noticed");
  body.replaceChildren();
  attempt.noticed.forEach((one, number) => {
    const row = element("tr", undefined, body);
    row.className = "noticed"; row.tabIndex = 0;
    element("span", number + 1, element("td", undefined, row)).className = "badge";
    element("td", clock(one.from_s), row); element("td", one.text, row);
    row.onclick = () => { shown.time_s = one.from_s; redraw(); };
    row.onkeydown = e => { if (e.key === "Enter") row.onclick(); };
  });
  if (!attempt.noticed.length) element("td", "nothing: no jump, no wrong branch, nothing pressed on the wall", element("tr", undefined, body));
}

function measures(attempt) {
  const body = at("measures"), verdict = at("verdict");
  body.replaceChildren();
  verdict.hidden = !attempt.verdict;
  verdict.textContent = attempt.verdict || "";
  verdict.className = `told ${attempt.passed ? "kept" : "missed"}`;
  for (const text of attempt.unjudged) element("p", text, verdict).className = "missed";
  let group = null;
  for (const one of attempt.metrics) {
    if (one.group !== group) { group = one.group; const cell = element("td", undefined, element("tr", undefined, body)); cell.colSpan = 3; element("h3", group, cell); }
    const row = element("tr", undefined, body);
    row.className = "measure";
    element("td", measure(one.name), row);
    element("td", withUnit(one.value, one.unit), row).className = "number";
    const asked = element("td", one.asked || "", row);
    if (one.asked) element("span", ` ${one.unjudged ? "not judged" : one.passed ? "kept" : "missed"}`, asked).className = one.passed ? "kept" : "missed";
    const definition = element("td", undefined, element("tr", undefined, body));
    definition.colSpan = 3;
    element("small", one.unjudged || one.definition, definition);
  }
}

function open(index) {
  const attempt = data.sessions[index];
  shown.attempt = index; shown.time_s = attempt.timeline.end_s;
  [...at("pick").children].forEach((button, k) => button.setAttribute("aria-pressed", String(k === index)));
  const where = attempt.target ? `${attempt.scene}, to ${attempt.target}` : attempt.scene, when = day(attempt.recorded_unix_s);
  at("about").textContent = [data.sessions.length > 1 ? `shown: ${attempt.name}` : where !== at("title").textContent && where, when, attempt.verdict].filter(Boolean).join(" · ");
  roadmap.open(attempt); timeline.open(attempt);
  noticed(attempt); measures(attempt); redraw();
}

document.title = `${data.title} · endowire`;
at("title").textContent = data.title;
at("source").textContent = data.source;
at("courses").hidden = !data.courses.length;
data.courses.forEach(one => course(one, at("courses")));
if (data.sessions.length > 1) {
  at("attempts").hidden = false;
  data.sessions.forEach((one, k) => { const when = day(one.recorded_unix_s); element("button", `${k + 1}  ${when || one.name}`, at("pick")).onclick = () => open(k); });
}
const drawAll = () => { drawings.forEach(draw => draw()); redraw(); };
open(data.sessions.length - 1); drawAll();
window.onresize = drawAll;
document.documentElement.dataset.drawnMs = performance.now().toFixed(0);
