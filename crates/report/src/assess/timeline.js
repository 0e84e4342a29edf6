// The timeline: beam and contrast medium, motion of each instrument, and forces, over a common axis of time.
const timeline = (() => {
  const canvas = at("line"), RIGHT = 12, FOOT = 24, GAP = 12, HEAD = 24;
  // Space for numbers on the left; less on a phone.
  const left = w => w < 520 ? 44 : 74;
  let lanes = [], LEFT = left(1000);

  // The lanes of an attempt, each with a height and a drawing function.
  function lanesOf({ timeline: t, instruments, limits }) {
    const all = [{ high: 30, name: t.beam ? "beam" : "beam: not recorded", draw: beam, mark: t.beam && turns(t.beam) ? "▲ C-arm turned" : "" }];
    if (t.injections.length) all.push({ high: 26, name: "contrast", draw: contrast });
    t.hands.forEach((hand, k) => {
      const name = instruments[k] || `hand ${k + 1}`, colour = COLOURS[k % COLOURS.length];
      all.push({ high: 64, name: `${name}, pushed or pulled (−)`, unit: "mm/s", curves: [{ of: hand.push_mm_per_s, colour, fill: true }], signed: true });
      if (hand.turn_deg_per_s.some(v => v !== 0)) all.push({ high: 44, name: `${name}, turned`, unit: "°/s", curves: [{ of: hand.turn_deg_per_s, colour, fill: true }], signed: true });
      if (hand.steer_per_s.some(v => v !== 0)) all.push({ high: 44, name: `${name}, steered`, unit: "1/s", curves: [{ of: hand.steer_per_s, colour, fill: true }], signed: true });
    });
    all.push({ high: 90, name: "wall forces", force: true, limit: limits.wall_force_n, curves: [{ of: t.wall_force_n, colour: RED, name: "all" }, { of: t.tip_force_n, colour: COLOURS[3], name: "tip" }] });
    all.push({ high: 64, name: "forces of hands", force: true, curves: t.hands.map((hand, k) => ({ of: hand.force_n, colour: COLOURS[k % COLOURS.length], name: t.hands.length > 1 ? instruments[k] || `hand ${k + 1}` : "" })) });
    if (t.packing_density.length) all.push({ high: 50, name: "sac filled", unit: "%", curves: [{ of: t.packing_density.map(part => 100 * part), colour: COLOURS[2], fill: true }] });
    all.filter(lane => lane.force).forEach(inUnit);
    let top = HEAD;
    for (const lane of all) { lane.top = top + 14; top += lane.high + 14 + GAP; }
    canvas.style.height = `${top + FOOT - GAP}px`;
    return all;
  }

  // Forces below 0.1 N are shown in millinewtons, for readable digits.
  function inUnit(lane) {
    const small = lane.curves.every(curve => curve.of.every(v => v < 0.1));
    lane.unit = small ? "mN" : "N";
    if (!small) return;
    lane.curves = lane.curves.map(curve => ({ ...curve, of: curve.of.map(v => 1000 * v) }));
    lane.limit = lane.limit && 1000 * lane.limit;
  }

  const turned = (a, b) => a.primary_deg !== b.primary_deg || a.secondary_deg !== b.secondary_deg;
  const turns = beam => beam.some((state, k) => k > 0 && turned(beam[k - 1], state));
  const across = (t, w) => time_s => LEFT + (w - LEFT - RIGHT) * (t.end_s > 0 ? time_s / t.end_s : 0);

  function beam(c, lane, attempt, px) {
    const t = attempt.timeline, states = t.beam || [];
    states.forEach((state, k) => {
      const to_s = k + 1 < states.length ? states[k + 1].time_s : t.end_s, before = states[k - 1];
      if (state.on) { c.fillStyle = "#e3b341"; c.fillRect(px(state.time_s), lane.top + 4, Math.max(1, px(to_s) - px(state.time_s)), lane.high - 12); }
      if (before && turned(before, state)) { c.fillStyle = "#1c2228"; c.beginPath(); const x = px(state.time_s), y = lane.top + lane.high; c.moveTo(x, y - 7); c.lineTo(x - 4, y); c.lineTo(x + 4, y); c.fill(); }
    });
    if (states.length) { c.strokeStyle = RULE; c.strokeRect(px(0), lane.top + 4, px(t.end_s) - px(0), lane.high - 12); }
  }

  function contrast(c, lane, attempt, px) {
    const t = attempt.timeline;
    c.strokeStyle = RULE; c.strokeRect(px(0), lane.top + 2, px(t.end_s) - px(0), lane.high - 4);
    let free = -1;
    for (const one of t.injections) {
      const from = px(one.time_s), wide = Math.max(3, px(Math.min(t.end_s, one.time_s + one.volume_ml / one.rate_ml_per_s)) - from), text = `${short(one.volume_ml)} ml`;
      c.fillStyle = COLOURS[2]; c.fillRect(from, lane.top + 2, wide, lane.high - 4);
      if (from < free) continue;
      // To the left if there is no space on the right.
      const room = from + wide + 3 + c.measureText(text).width < px(t.end_s);
      c.fillStyle = "#1c2228"; c.textAlign = room ? "left" : "right";
      c.fillText(text, room ? from + wide + 3 : from - 3, lane.top + lane.high / 2 + 4);
      free = from + wide + 7 + c.measureText(text).width;
    }
  }

  function curves(c, lane, attempt, px, w) {
    const t = attempt.timeline, all = lane.curves.flatMap(curve => curve.of), most = all.reduce((m, v) => Math.max(m, Math.abs(v)), 0);
    const asked = lane.limit && lane.limit < 3 * most ? lane.limit : 0;
    const high = Math.max(all.reduce((m, v) => Math.max(m, v), 0), asked) || (lane.signed ? 0 : 1), low = Math.min(0, all.reduce((m, v) => Math.min(m, v), 0));
    const span = high - low || 1, py = v => lane.top + 2 + (lane.high - 4) * (high - v) / span;
    c.fillStyle = GREY; c.strokeStyle = RULE; c.lineWidth = 1; c.textAlign = "right";
    for (const v of new Set([low, 0, high])) {
      c.beginPath(); c.moveTo(LEFT, py(v)); c.lineTo(w - RIGHT, py(v)); c.stroke();
      if (v === 0 || Math.abs(py(v) - py(0)) > 11) c.fillText(short(v), LEFT - 5, py(v) + 4);
    }
    if (asked) {
      c.strokeStyle = RED; c.setLineDash([5, 4]); c.beginPath(); c.moveTo(LEFT, py(asked)); c.lineTo(w - RIGHT, py(asked)); c.stroke(); c.setLineDash([]);
      c.fillStyle = RED; c.fillText("limit", w - RIGHT - 4, py(asked) + 12);
    }
    for (const curve of lane.curves) {
      c.beginPath();
      curve.of.forEach((v, k) => { const [a, b] = [px(k * t.piece_s), px((k + 1) * t.piece_s)]; k ? c.lineTo(a, py(v)) : c.moveTo(a, py(v)); c.lineTo(b, py(v)); });
      c.strokeStyle = curve.colour; c.lineWidth = 1.3; c.lineJoin = "round"; c.stroke();
      if (curve.fill) { c.lineTo(px(t.end_s), py(0)); c.lineTo(px(0), py(0)); c.globalAlpha = 0.25; c.fillStyle = curve.colour; c.fill(); c.globalAlpha = 1; }
    }
  }

  // The lane's name, its unit, and the names of its curves.
  function head(c, lane) {
    c.textAlign = "left"; c.fillStyle = "#1c2228";
    const name = lane.unit ? `${lane.name}, ${lane.unit}` : lane.name;
    c.fillText(name, LEFT, lane.top - 3);
    let x = LEFT + c.measureText(name).width + 14;
    if (lane.mark) { c.fillStyle = GREY; c.fillText(lane.mark, x, lane.top - 3); }
    for (const curve of (lane.curves || []).filter(curve => curve.name)) { c.fillStyle = curve.colour; c.fillText(curve.name, x, lane.top - 3); x += c.measureText(curve.name).width + 12; }
  }

  function axis(c, t, px, w, h) {
    const step = tick(Math.max(t.end_s, 1e-3), Math.max(3, w / 110));
    c.fillStyle = GREY; c.strokeStyle = "#edf0f3"; c.lineWidth = 1;
    for (let s = 0; s <= t.end_s * (1 + 1e-9); s += step) {
      c.beginPath(); c.moveTo(px(s), HEAD); c.lineTo(px(s), h - FOOT + 6); c.stroke();
      c.textAlign = s === 0 ? "left" : px(s) > w - 40 ? "right" : "center";
      c.fillText(t.end_s < 90 ? `${+s.toFixed(3)} s` : clock(Math.round(s)).replace(" min", "").replace(".0", ""), px(s), h - 4);
    }
  }

  // Places of the numbers of events: where they begin, side by side where there is no room, and within the canvas.
  function places(from, w) {
    const APART = 17, RADIUS = 9, xs = [];
    from.forEach((x, k) => { xs[k] = Math.max(x, k ? xs[k - 1] + APART : RADIUS); });
    for (let k = xs.length - 1; k >= 0; k--) xs[k] = Math.min(xs[k], k + 1 < xs.length ? xs[k + 1] - APART : w - RADIUS);
    return xs;
  }

  // Events: shaded while they last, with their number above.
  function noticed(c, attempt, px, w, h) {
    const xs = places(attempt.noticed.map(one => px(one.from_s)), w);
    canvas.dataset.numbers = xs.map(x => x.toFixed(1)).join(" ");
    c.textAlign = "center"; c.font = "bold 10px system-ui, sans-serif";
    attempt.noticed.forEach((one, number) => {
      const from = px(one.from_s), x = xs[number];
      c.fillStyle = RED; c.globalAlpha = 0.1; c.fillRect(from, HEAD - 8, Math.max(1.5, px(one.to_s) - from), h - FOOT - HEAD + 12); c.globalAlpha = 1;
      c.beginPath(); c.arc(x, 9, 8, 0, 7); c.fill();
      c.fillStyle = "#fff"; c.fillText(number + 1, x, 12.5);
    });
    c.font = "11px system-ui, sans-serif";
  }

  function draw() {
    const attempt = data.sessions[shown.attempt], t = attempt.timeline, [c, w, h] = fitted(canvas);
    LEFT = left(w);
    const px = across(t, w);
    axis(c, t, px, w, h);
    for (const lane of lanes) { head(c, lane); lane.draw ? lane.draw(c, lane, attempt, px) : curves(c, lane, attempt, px, w); }
    noticed(c, attempt, px, w, h);
    c.strokeStyle = "#1c2228"; c.lineWidth = 1; c.beginPath(); c.moveTo(px(shown.time_s), HEAD - 8); c.lineTo(px(shown.time_s), h - FOOT + 6); c.stroke();
    now(attempt);
  }

  function now({ timeline: t, instruments }) {
    const piece = Math.max(0, Math.min(t.tip_mm.length - 1, Math.ceil(shown.time_s / t.piece_s) - 1));
    const hands = t.hands.map((hand, k) => `${instruments[k] || `hand ${k + 1}`} ${short(hand.inserted_mm[piece])} mm in`);
    const state = (t.beam || []).findLast(state => state.time_s <= shown.time_s);
    const words = [clock(shown.time_s), ...hands, `wall ${newtons(t.wall_force_n[piece])}`, t.beam ? `beam ${state?.on ? "on" : "off"}` : ""];
    at("now").textContent = words.filter(Boolean).join(", ");
  }

  function move(e) {
    const t = data.sessions[shown.attempt].timeline, box = canvas.getBoundingClientRect();
    shown.time_s = t.end_s * Math.max(0, Math.min(1, (e.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT)));
    redraw();
  }
  canvas.onpointerdown = e => { canvas.setPointerCapture(e.pointerId); move(e); };
  canvas.onpointermove = e => { if (e.buttons) move(e); };
  return { draw, open: attempt => { lanes = lanesOf(attempt); } };
})();
