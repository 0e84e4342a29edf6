// Shared by the parts of the page: elements, numbers, canvases, and the selected attempt and time.
const at = id => document.getElementById(id);
const COLOURS = ["#1557a0", "#d55e00", "#009e73", "#7a4fa3"];
const RED = "#b3261e", GREEN = "#0b6b3a", GREY = "#67717b", RULE = "#dde1e6";
const shown = { attempt: 0, time_s: 0 };

function element(tag, text, to) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (to) to.append(made);
  return made;
}

// Rounds a number for reading.
function short(value) {
  if (value === null || value === undefined) return "–";
  if (Number.isInteger(value)) return String(value);
  return Math.abs(value) >= 1000 ? value.toFixed(0) : String(+value.toPrecision(3));
}

const newtons = n => n < 0.1 ? `${short(1000 * n)} mN` : `${short(n)} N`;
const withUnit = (value, unit) => value === null || unit === "1" ? short(value) : `${short(value)} ${unit}`;
const measure = name => name.replace(/_(s|n|mm|ml|ns|nmm|ugy|ugycm2|cm2|ml_per_s|mm_per_s)$/, "").replace(/_/g, " ").replace(/^c arm/, "C-arm");
const clock = s => s < 60 ? `${s.toFixed(1)} s` : `${Math.floor(s / 60)}:${String(Math.floor(s % 60)).padStart(2, "0")} min`;
const day = unix_s => unix_s === null || unix_s === undefined ? null : new Date(1000 * unix_s).toLocaleString([], { dateStyle: "medium", timeStyle: "short" });

// A canvas with the resolution of the screen, and its size.
function fitted(canvas) {
  const ratio = window.devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
  const [wide, high] = [Math.round(w * ratio), Math.round(h * ratio)];
  if (canvas.width !== wide || canvas.height !== high) { canvas.width = wide; canvas.height = high; }
  const c = canvas.getContext("2d");
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.clearRect(0, 0, w, h);
  c.font = "11px system-ui, sans-serif";
  return [c, w, h];
}

// A step of 1, 2 or 5 times a power of ten, of which about this many fit.
function tick(range, count) {
  const rough = range / count, power = 10 ** Math.floor(Math.log10(rough)), part = rough / power;
  return power * (part < 1.5 ? 1 : part < 3.5 ? 2 : part < 7.5 ? 5 : 10);
}
