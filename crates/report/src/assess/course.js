// A trainee's course: the score over attempts, and each measure with its trend.
const WORDS = { better: "gets better", worse: "gets worse", none: "" };

function course(of, to) {
  const section = element("section", undefined, to), attempts = of.attempts.map(k => data.sessions[k]);
  section.className = "whole";
  const where = of.target ? `${of.scene}, ${of.target}` : of.scene;
  element("h2", `Course: ${where}`, section);
  const first = day(attempts[0].recorded_unix_s), last = day(attempts[attempts.length - 1].recorded_unix_s);
  const order = of.ordered_by === "recorded" ? `from ${first} to ${last}` : "in the order in which they were named, for not all say when they were recorded";
  const few = attempts.length < 4 ? " Of fewer than four attempts no trend is told." : "";
  element("p", `${attempts.length} attempts, ${order}.${few}`, section).className = "told";
  if (of.score) score(of, attempts, section);
  trends(of, "better", section);
  trends(of, "worse", section);
  lines(of, section);
  element("p", "A trend is told where no more than one in twenty orders of the same values would go as steadily that way: of all these measures, one or two may seem to have one by chance.", section).className = "told";
}

function trends(of, trend, section) {
  const names = of.metrics.filter(one => one.trend === trend).map(one => measure(one.name));
  if (!names.length) return;
  const line = element("p", undefined, section);
  line.className = "told";
  element("b", trend === "better" ? "Gets better: " : "Gets worse: ", line).className = trend;
  line.append(names.join(", "));
}

function score(of, attempts, section) {
  const told = of.score, change = !told.per_attempt ? "" : `, ${told.per_attempt < 0 ? "−" : "+"}${short(Math.abs(told.per_attempt))} from one attempt to the next`;
  const trend = WORDS[told.trend], passed = of.passed.filter(Boolean).length;
  element("h3", "Score", section);
  element("p", `passed ${passed} of ${attempts.length}${change}${trend ? `; ${trend}` : ""}`, section).className = "told";
  const canvas = element("canvas", undefined, section);
  canvas.className = "score"; canvas.setAttribute("role", "img"); canvas.setAttribute("aria-label", `Scores: ${told.values.map(short).join(", ")}`);
  drawings.push(() => {
    const [c, w, h] = fitted(canvas), px = place(told.values.length, 34, w - 14), py = v => 10 + (h - 34) * (100 - v) / 100;
    c.fillStyle = GREY; c.strokeStyle = RULE;
    for (const v of [0, 50, 100]) { c.beginPath(); c.moveTo(34, py(v)); c.lineTo(w - 8, py(v)); c.stroke(); c.textAlign = "right"; c.fillText(v, 28, py(v) + 4); }
    c.textAlign = "center";
    const every = Math.ceil(told.values.length * 26 / w);
    told.values.forEach((v, k) => { if (k % every === 0) c.fillText(k + 1, px(k), h - 6); });
    through(c, told.values, px, py, "#9aa4ae");
    told.values.forEach((v, k) => { c.fillStyle = of.passed[k] ? GREEN : RED; c.beginPath(); c.arc(px(k), py(v), 5, 0, 7); c.fill(); });
  });
  const key = element("p", undefined, section);
  key.className = "key";
  for (const [colour, text] of [[GREEN, "passed"], [RED, "not passed"]]) { const span = element("span", text, key), mark = document.createElement("i"); mark.style.background = colour; span.prepend(mark); }
}

const place = (count, left, right) => k => count < 2 ? (left + right) / 2 : left + 8 + (right - left - 8) * k / (count - 1);

// A curve through the measured values.
function through(c, values, px, py, colour) {
  c.strokeStyle = colour; c.lineWidth = 1.5; c.beginPath();
  let drawn = false;
  values.forEach((v, k) => { if (v === null) return; drawn ? c.lineTo(px(k), py(v)) : c.moveTo(px(k), py(v)); drawn = true; });
  c.stroke();
}

function lines(of, section) {
  const table = element("table", undefined, section), head = element("tr", undefined, element("thead", undefined, table)), body = element("tbody", undefined, table);
  for (const [text, wide] of [["measure"], ["attempts"], ["first → last"], ["best", true], ["change each", true], ["trend"]]) element("th", text, head).className = wide ? "wide" : "";
  let group = null;
  for (const one of of.metrics.filter(one => one.first !== null)) {
    if (one.group !== group) { group = one.group; const cell = element("td", undefined, element("tr", undefined, body)); cell.colSpan = 6; element("h3", group, cell); }
    const row = element("tr", undefined, body), name = element("td", measure(one.name), row);
    name.append(document.createElement("br"), element("small", `${one.unit === "1" ? "" : `${one.unit}, `}${one.better === "lower" ? "less" : "more"} is better`));
    spark(one, element("td", undefined, row));
    element("td", `${short(one.first)} → ${short(one.last)}`, row).className = "number pair";
    element("td", short(one.best), row).className = "number wide";
    element("td", one.per_attempt === null ? "–" : Math.abs(one.per_attempt) < 1e-9 * Math.abs(one.last) ? "0" : `${one.per_attempt > 0 ? "+" : one.per_attempt < 0 ? "−" : ""}${short(Math.abs(one.per_attempt))}`, row).className = "number wide";
    element("td", WORDS[one.trend].replace("gets ", ""), row).className = one.trend;
  }
}

function spark(one, cell) {
  const canvas = element("canvas", undefined, cell);
  canvas.className = "spark"; canvas.title = one.values.map(short).join(", "); canvas.setAttribute("role", "img"); canvas.setAttribute("aria-label", canvas.title);
  drawings.push(() => {
    const [c, w, h] = fitted(canvas), known = one.values.filter(v => v !== null), low = Math.min(...known), high = Math.max(...known);
    // What differs by less than a fiftieth stays nearly flat: rounding must not look like progress.
    const span = Math.max(high - low, 0.02 * Math.max(Math.abs(low), Math.abs(high))) || 1;
    const differ = high - low > 1e-9 * Math.max(Math.abs(low), Math.abs(high)), px = place(one.values.length, 0, w - 6);
    const py = v => h / 2 - (h - 10) * (v - (low + high) / 2) / span;
    through(c, one.values, px, py, "#9aa4ae");
    one.values.forEach((v, k) => { if (v === null) return; const best = v === one.best && differ; c.fillStyle = best ? GREEN : "#4a545e"; c.beginPath(); c.arc(px(k), py(v), best ? 3 : 2, 0, 7); c.fill(); });
  });
}
