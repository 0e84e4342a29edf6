// The roadmap: the vessel's outline as projected by the C-arm with parallel rays, and the path of the tip over it.
const roadmap = (() => {
  const canvas = at("roadmap"), view = { primary: 0, secondary: 0, near: true };
  let outline = null;

  // From patient axes (left, back, head) to a picture seen from the detector: LAO and cranial angles are positive.
  function projection(attempt, w, h) {
    const rad = Math.PI / 180, [s, c] = [Math.sin(view.primary * rad), Math.cos(view.primary * rad)];
    const [t, d] = [Math.sin(view.secondary * rad), Math.cos(view.secondary * rad)];
    const flat = p => { const back = p[1] * c - p[0] * s; return [p[0] * c + p[1] * s, -(p[2] * d + back * t)]; };
    const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    const take = p => flat(p).forEach((x, k) => { low[k] = Math.min(low[k], x); high[k] = Math.max(high[k], x); });
    const way = attempt.timeline.tip_mm.filter(Boolean);
    const vessel = data.vessels[attempt.vessel];
    if (view.near && way.length) {
      way.forEach(take);
      if (attempt.target_mm) take(attempt.target_mm);
      const margin = Math.max(15, 0.12 * Math.max(high[0] - low[0], high[1] - low[1]));
      low.forEach((x, k) => { low[k] = x - margin; high[k] += margin; });
    } else {
      for (let k = 0; k < vessel.vertices.length; k += 3) take([0, 1, 2].map(i => vessel.vertices[k + i] / 10));
    }
    const scale = 0.94 * Math.min(w / (high[0] - low[0] || 1), h / (high[1] - low[1] || 1));
    const middle = low.map((x, k) => (x + high[k]) / 2);
    return { scale, to: p => { const q = flat(p); return [w / 2 + scale * (q[0] - middle[0]), h / 2 + scale * (q[1] - middle[1])]; } };
  }

  // All triangles with thick edges, then all again in the inner colour: what remains of the edges is the outline.
  function drawOutline(attempt, to, w, h, ratio) {
    const key = JSON.stringify([attempt.vessel, shown.attempt, view, w, h, ratio]);
    if (outline?.key === key) return outline.picture;
    const picture = document.createElement("canvas"), vessel = data.vessels[attempt.vessel], v = vessel.vertices, p = [];
    picture.width = w * ratio; picture.height = h * ratio;
    const c = picture.getContext("2d");
    c.scale(ratio, ratio); c.lineJoin = "round";
    for (let k = 0; k < v.length; k += 3) p.push(to([v[k] / 10, v[k + 1] / 10, v[k + 2] / 10]));
    const path = new Path2D();
    for (const [i, j, k] of vessel.triangles) {
      // With equal orientation, so that overlapping triangles do not cut holes into each other.
      const turns = (p[j][0] - p[i][0]) * (p[k][1] - p[i][1]) - (p[j][1] - p[i][1]) * (p[k][0] - p[i][0]) > 0;
      path.moveTo(...p[i]); path.lineTo(...p[turns ? j : k]); path.lineTo(...p[turns ? k : j]); path.closePath();
    }
    c.strokeStyle = "#8d98a3"; c.lineWidth = 3; c.stroke(path);
    c.fillStyle = c.strokeStyle = "#fbfcfd"; c.lineWidth = 0.8; c.fill(path); c.stroke(path);
    outline = { key, picture };
    return picture;
  }

  function drawWay(c, attempt, to) {
    const { tip_mm: tips, wrong, piece_s } = attempt.timeline, now = Math.min(tips.length - 1, Math.ceil(shown.time_s / piece_s) - 1);
    c.lineJoin = c.lineCap = "round";
    // The later path is faint and drawn first.
    for (const later of [true, false]) {
      for (let k = 1; k < tips.length; k++) {
        if (!tips[k] || !tips[k - 1] || (k > now) !== later) continue;
        c.strokeStyle = wrong[k] ? RED : COLOURS[0];
        c.globalAlpha = later ? 0.22 : 0.9; c.lineWidth = wrong[k] ? 2.6 : 2;
        c.beginPath(); c.moveTo(...to(tips[k - 1])); c.lineTo(...to(tips[k])); c.stroke();
      }
    }
    c.globalAlpha = 1;
    drawTip(c, tips[Math.max(0, now)], to, COLOURS[0]);
    // The instrument that must arrive, unless it is the foremost one.
    const others = attempt.timeline.arriving_mm;
    c.strokeStyle = COLOURS[1]; c.lineWidth = 1.6; c.setLineDash([5, 3]); c.beginPath();
    others.slice(0, now + 1).forEach((tip, k) => { if (tip) others[k - 1] ? c.lineTo(...to(tip)) : c.moveTo(...to(tip)); });
    c.stroke(); c.setLineDash([]);
    drawTip(c, others[Math.max(0, now)], to, COLOURS[1]);
  }

  function drawTip(c, tip, to, colour) {
    if (!tip) return;
    c.fillStyle = colour; c.strokeStyle = "#fff"; c.lineWidth = 2;
    c.beginPath(); c.arc(...to(tip), 5.5, 0, 7); c.fill(); c.stroke();
  }

  function drawTarget(c, attempt, to, scale, w) {
    if (!attempt.target_mm) return;
    const [x, y] = to(attempt.target_mm), r = Math.max(6, scale * attempt.within_mm);
    c.strokeStyle = GREEN; c.fillStyle = GREEN; c.lineWidth = 1.6;
    c.setLineDash([4, 3]); c.beginPath(); c.arc(x, y, r, 0, 7); c.stroke(); c.setLineDash([]);
    const wide = c.measureText(attempt.target).width, left = x + r + 4 + wide > w - 4;
    c.textAlign = left ? "right" : "left";
    c.lineWidth = 3; c.strokeStyle = "#fff"; c.strokeText(attempt.target, x + (left ? -r - 4 : r + 4), y + 4);
    c.fillText(attempt.target, x + (left ? -r - 4 : r + 4), y + 4);
  }

  // The free place for a number that is nearest to a point: to its right, then around it, ever farther out.
  function placeAt([x, y], taken, w, h) {
    for (let ring = 14; ring < Math.max(w, h); ring += 6) {
      const many = Math.ceil(ring / 3);
      for (let k = 0; k < many; k++) {
        const angle = Math.PI * (k % 2 ? -1 : 1) * Math.ceil(k / 2) * 2 / many;
        const at = [x + ring * Math.cos(angle), y + ring * Math.sin(angle)];
        const inside = at[0] > 9 && at[1] > 9 && at[0] < w - 9 && at[1] < h - 9;
        if (inside && taken.every(([a, b]) => Math.hypot(a - at[0], b - at[1]) >= 17)) return at;
      }
    }
    return [x, y];
  }

  // A number for each event, beside the position of the tip, with a line to it.
  function drawNoticed(c, attempt, to, w, h) {
    const { tip_mm: tips, piece_s } = attempt.timeline, taken = [];
    c.textAlign = "center"; c.font = "bold 10px system-ui, sans-serif";
    attempt.noticed.forEach((one, number) => {
      const tip = tips[Math.max(0, Math.min(tips.length - 1, Math.ceil(one.from_s / piece_s) - 1))];
      if (!tip) return;
      const point = to(tip), [x, y] = placeAt(point, taken, w, h);
      taken.push([x, y]);
      c.strokeStyle = RED; c.lineWidth = 1; c.beginPath(); c.moveTo(...point); c.lineTo(x, y); c.stroke();
      c.fillStyle = RED; c.beginPath(); c.arc(x, y, 8, 0, 7); c.fill();
      c.fillStyle = "#fff"; c.fillText(number + 1, x, y + 3.5);
    });
    canvas.dataset.numbers = taken.map(place => place.map(x => x.toFixed(1)).join(",")).join(" ");
    c.font = "11px system-ui, sans-serif";
  }

  function drawScale(c, scale, w, h) {
    const mm = tick(w / scale, 5), long = mm * scale;
    c.strokeStyle = c.fillStyle = "#1c2228"; c.lineWidth = 1.5; c.textAlign = "left";
    c.beginPath(); c.moveTo(12, h - 18); c.lineTo(12, h - 12); c.lineTo(12 + long, h - 12); c.lineTo(12 + long, h - 18); c.stroke();
    c.fillText(`${mm} mm`, 16, h - 17);
    c.textAlign = "right"; c.fillText(pose(view.primary, view.secondary), w - 12, h - 14);
  }

  function draw() {
    const attempt = data.sessions[shown.attempt], [c, w, h] = fitted(canvas), { to, scale } = projection(attempt, w, h);
    c.drawImage(drawOutline(attempt, to, w, h, window.devicePixelRatio || 1), 0, 0, w, h);
    drawWay(c, attempt, to);
    drawTarget(c, attempt, to, scale, w);
    drawNoticed(c, attempt, to, w, h);
    drawScale(c, scale, w, h);
  }

  // The angles in clinical notation.
  function pose(primary, secondary) {
    const side = Math.round(primary), up = Math.round(secondary);
    const words = [side && `${side > 0 ? "LAO" : "RAO"} ${Math.abs(side)}`, up && `${up > 0 ? "CRA" : "CAU"} ${Math.abs(up)}`].filter(Boolean);
    return words.join(" ") || "AP";
  }

  // A button for each pose that was used, in order of decreasing beam time.
  function choose(attempt) {
    const used = new Map(), beam = attempt.timeline.beam || [];
    beam.forEach((state, k) => {
      const key = pose(state.primary_deg, state.secondary_deg), to_s = k + 1 < beam.length ? beam[k + 1].time_s : attempt.timeline.end_s;
      const known = used.get(key) || { s: 0, angles: [state.primary_deg, state.secondary_deg] };
      known.s += state.on ? to_s - state.time_s : 0;
      used.set(key, known);
    });
    if (!used.size) used.set(pose(...attempt.pose), { s: 0, angles: attempt.pose });
    if (!used.has("AP")) used.set("AP", { s: -1, angles: [0, 0] });
    const all = [...used].sort((a, b) => b[1].s - a[1].s).slice(0, 6), row = at("poses");
    row.replaceChildren();
    for (const [name, { angles }] of all) {
      element("button", name, row).onclick = () => { [view.primary, view.secondary] = angles; draw(); };
    }
    const whole = element("button", "whole vessel", row);
    whole.setAttribute("aria-pressed", "false");
    whole.onclick = () => { view.near = !view.near; whole.setAttribute("aria-pressed", String(!view.near)); draw(); };
    view.near = true;
    [view.primary, view.secondary] = all[0][1].angles;
  }

  function key(attempt) {
    const row = at("way-key"), add = (colour, text) => { const span = element("span", text, row), mark = document.createElement("i"); mark.style.background = colour; span.prepend(mark); };
    row.replaceChildren();
    add(COLOURS[0], "way of the foremost tip");
    if (attempt.timeline.arriving_mm.length) add(COLOURS[1], `tip of ${attempt.instruments[attempt.arriving]}, which is to arrive`);
    if (attempt.timeline.wrong.some(Boolean)) add(RED, "in a wrong branch");
    if (attempt.target_mm) add(GREEN, "target");
  }

  let held = null;
  canvas.onpointerdown = e => { held = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); };
  canvas.onpointerup = canvas.onpointercancel = () => { held = null; };
  canvas.onpointermove = e => {
    if (!held) return;
    view.primary = Math.max(-120, Math.min(120, view.primary - 0.4 * (e.clientX - held[0])));
    if (e.pointerType === "mouse") view.secondary = Math.max(-60, Math.min(60, view.secondary + 0.4 * (e.clientY - held[1])));
    held = [e.clientX, e.clientY];
    draw();
  };
  return { draw, open: attempt => { choose(attempt); key(attempt); } };
})();
