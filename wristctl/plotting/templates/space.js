"use strict";
// Draws the wrist in space from its recorded coordinates, as it is looked at; x is along the straight wrist, y toward
// ulnar, z toward flexion, lengths in mm.
{
  const motion = JSON.parse(document.getElementById("motion").textContent), { wrist, tendons, units, duration } = motion;
  const BLACK = "#000", DARK = "#5A5A5A", GREY = "#7F7F7F", SILVER = "#C8C8C8", BAND = "#A6A6A6", GREEN = "#009E73", SPACE = "http://www.w3.org/2000/svg", FINE = 8;
  const length = 1e3 * wrist.length, rim = 1e3 * wrist.rim, hand = 1e3 * wrist.hand, thick = 0.035 * length;
  const stage = document.getElementById("stage"), views = document.getElementById("view"), keys = document.getElementById("keys"), said = document.getElementById("said");
  const scaled = (rows, unit) => rows.map(row => row.map(value => value * unit));
  const bends = scaled(motion.bends, units.angle), wanted = scaled(motion.wanted, units.angle), pulls = scaled(motion.pulls, units.pull);
  const tips = scaled(motion.tip, 1e3 * units.place), goals = scaled(motion.tip_desired, 1e3 * units.place);
  const most = Math.max(1, ...pulls.flat()), last = bends.length - 1;

  const add = (a, b, by = 1) => a.map((value, i) => value + by * b[i]);
  const mixed = (a, b, share) => a.map((value, i) => value + share * (b[i] - value));
  const times = (m, v) => m.map(row => row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
  const column = (m, j) => m.map(row => row[j]);
  const product = (a, b) => { const columns = [0, 1, 2].map(j => times(a, column(b, j))); return [0, 1, 2].map(i => columns.map(each => each[i])); };
  const sinc = x => Math.abs(x) < 1e-6 ? 1 - x * x / 6 : Math.sin(x) / x;

  // Rotation by a bend, and the chord of an arc that bends by it: wristctl/wrist/spatial/spatial_kinematics.py.
  function turned([y, z]) {
    const size = Math.hypot(y, z), s = sinc(size), c = 0.5 * sinc(size / 2) ** 2;
    return [[Math.cos(size), -s * y, -s * z], [s * y, 1 - c * y * y, -c * y * z], [s * z, -c * y * z, 1 - c * z * z]];
  }
  function chord([y, z], arc) {
    const half = Math.hypot(y, z) / 2, s = sinc(half);
    return [arc * s * Math.cos(half), arc * s * s * y / 2, arc * s * s * z / 2];
  }
  // From the base of a part to a share of it: along an arc, or along rigid links with a hinge between them.
  function within(q, share, arc) {
    if (!motion.hinged) {
      const u = q.map(bend => share * bend);
      return [chord(u, share * arc), turned(u)];
    }
    const frame = turned(share > 0.5 ? q : [0, 0]);
    return [add([Math.min(share, 0.5) * arc, 0, 0], column(frame, 0), Math.max(share - 0.5, 0) * arc), frame];
  }
  // Centre and frame of a wrist's cross-sections, so many spans from base to tip.
  function sections(q, spans) {
    const n = q.length / 2, found = [];
    let base = { centre: [0, 0, 0], frame: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }, k = 0;
    const at = share => {
      const [ahead, turn] = within([q[2 * k], q[2 * k + 1]], share, length / n);
      return { centre: add(base.centre, times(base.frame, ahead)), frame: product(base.frame, turn) };
    };
    for (let i = 0; i <= spans; i++) {
      for (; k < n - 1 && i / spans * n >= k + 1; k++) base = at(1);
      found.push(at(i / spans * n - k));
    }
    return found;
  }
  const point = (section, x, y, z) => add(section.centre, times(section.frame, [x, y, z]));

  // The picture holds whatever the wrist does, from wherever it is looked at.
  const floor = -0.3 * length, middle = (length + 2 * hand + floor) / 2, ground = 25 * Math.ceil(1.6 * rim / 25), far = 6 * (length + 2 * hand);
  const held = [[floor, 0, 1.25 * ground], ...bends.map(q => point(sections(q, 1)[1], 2 * hand, 0, 0))];
  const high = 1.1 * Math.max(...held.map(([x, y, z]) => Math.hypot(x - middle, y, z)));
  const wide = 1.1 * (Math.max(...held.map(([, y, z]) => Math.hypot(y, z))) + 0.7 * Math.max(hand, rim));
  let azimuth = 0, elevation = 0;

  // A direction as it is looked at: to the right, down, away.
  function looked([x, y, z]) {
    const behind = z * Math.cos(azimuth) - y * Math.sin(azimuth);
    const right = y * Math.cos(azimuth) + z * Math.sin(azimuth), down = -(x * Math.cos(elevation) + behind * Math.sin(elevation));
    return [right, down, behind * Math.cos(elevation) - x * Math.sin(elevation)];
  }
  // To the right, down, away, and by how much larger what is near is drawn.
  function seen([x, y, z]) {
    const [right, down, away] = looked([x - middle, y, z]), near = far / (far + away);
    return [near * right, near * down, away, near];
  }
  const line = points => "M" + points.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L");
  const around = Array.from({ length: 40 }, (_, k) => [Math.cos(k * Math.PI / 20), Math.sin(k * Math.PI / 20)]);
  const circle = (section, radius, x = 0) => around.map(([c, s]) => seen(point(section, x, radius * c, radius * s)));
  const ball = ([x, y, , near], radius) => around.filter((_, k) => k % 2 === 0).map(([c, s]) => [x + near * radius * c, y + near * radius * s]);

  // Outline of points, by Andrew's monotone chain.
  function outline(points) {
    const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    const half = list => {
      const kept = [];
      for (const p of list) {
        while (kept.length > 1) {
          const [a, b] = kept.slice(-2);
          if ((b[0] - a[0]) * (p[1] - a[1]) > (b[1] - a[1]) * (p[0] - a[0])) break;
          kept.pop();
        }
        kept.push(p);
      }
      return kept.slice(0, -1);
    };
    return line([...half(sorted), ...half(sorted.reverse())]) + "Z";
  }

  // Parts of a hand: balls (along, toward ulnar, toward flexion, radius) that each holds; its palm is toward flexion.
  const finger = (tip, end) => [[[0.9, 0.85 * end, 0, 0.1], [0.5 * (0.95 + tip), end, 0.03, 0.09]], [[0.5 * (0.95 + tip), end, 0.03, 0.09], [tip, end, 0.14, 0.075]]];
  const HAND = [
    [[0.24, -0.15, 0, 0.14], [0.24, 0.15, 0, 0.14], [0.88, -0.3, 0, 0.13], [0.84, 0.3, 0, 0.13]],
    ...[[1.7, -0.35], [1.82, -0.12], [1.75, 0.12], [1.5, 0.35]].flatMap(([tip, end]) => finger(tip, end)),
    [[0.4, -0.22, 0.06, 0.11], [0.74, -0.5, 0.18, 0.1]], [[0.74, -0.5, 0.18, 0.1], [1, -0.62, 0.3, 0.08]],
  ];

  const element = (parent, name, attributes = {}) => {
    const made = parent.appendChild(document.createElementNS(SPACE, name));
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    return made;
  };
  const svg = element(stage, "svg", { "aria-hidden": "true", viewBox: `${-wide} ${-high} ${2 * wide} ${2 * high}` }), pool = [];
  const shapes = element(svg, "g", { "stroke-linejoin": "round" });
  const texts = element(svg, "g", { fill: GREY, "dominant-baseline": "middle" });
  const labels = [["ulnar", 1, 0], ["radial", -1, 0], ["flexion", 0, 1], ["extension", 0, -1]].map(([name, y, z]) => {
    const text = element(texts, "text");
    text.textContent = name;
    return [text, y, z];
  });
  const pulled = motion.gravity.some(Boolean) ? motion.gravity.map(each => each / Math.hypot(...motion.gravity)) : null;
  const weight = element(svg, "path", { fill: "none", stroke: GREY, "stroke-width": 1.2, "stroke-linecap": "round" });
  const weightName = element(texts, "text", { x: -0.86 * wide, y: 0.92 * high, "text-anchor": "middle" });
  weightName.textContent = pulled ? "gravity" : "";

  // In a corner, as it is looked at; where it points at the reader or away its head alone.
  function ofGravity() {
    const [right, down] = looked(pulled), shown = Math.hypot(right, down) || 1, long = 0.16 * high, size = 0.045 * high;
    const cx = -0.86 * wide, cy = 0.72 * high;
    const end = [cx + long / 2 * right, cy + long / 2 * down], ahead = [right / shown, down / shown];
    const wing = side => [end[0] - size * (ahead[0] - side * ahead[1]), end[1] - size * (ahead[1] + side * ahead[0])];
    return line([[cx - long / 2 * right, cy - long / 2 * down], end]) + line([wing(0.6), end, wing(-0.6)]);
  }

  const entry = (style, words) => {
    const item = keys.appendChild(document.createElement("li")), mark = item.appendChild(document.createElement("i")), text = item.appendChild(document.createElement("span"));
    mark.style.borderTop = style;
    text.textContent = words;
    return text;
  };
  entry(`5px solid ${BAND}`, "tip wanted");
  entry(`2px solid ${GREEN}`, "tip reached");
  const forces = tendons.map((tendon, k) => [entry(`3px solid ${tendon.colour}`, ""), `tendon ${tendon.number}${tendon.discs < wrist.discs ? `, to disc ${tendon.discs}` : ""}`]);
  entry(`1px solid ${SILVER}`, `radius ${ground} mm`);

  // A path of the tip in two parts: what is farther away than the tip, and what is nearer.
  function parted(points, depth) {
    const runs = [[], []];
    let side = -1;
    points.forEach((each, k) => {
      const now = Number(each[2] < depth);
      if (now !== side) runs[now].push(k ? [points[k - 1]] : []);
      side = now;
      runs[now].at(-1).push(each);
    });
    return runs.map(found => found.filter(run => run.length > 1).map(line).join(""));
  }

  const shape = (d, style) => ({ d, style: { fill: "none", stroke: "none", "stroke-width": 1, "stroke-dasharray": "none", "stroke-linecap": "butt", opacity: 1, ...style } });
  const dot = (at, radius, fill) => shape(outline(ball(at, radius)), { fill });
  const GROUND = { stroke: SILVER, "stroke-width": 0.6 }, BODY = { fill: "#EAEAEA", stroke: GREY, "stroke-width": 0.5 };
  const base = { centre: [floor, 0, 0], frame: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] };

  function onFloor() {
    return [
      shape(line(circle(base, ground)) + "Z", GROUND),
      ...[[ground, 0], [0, ground]].map(([y, z]) => shape(line([seen([floor, y, z]), seen([floor, -y, -z])]), GROUND)),
      shape(outline([0, -floor].flatMap(x => circle(base, 0.92 * rim, x))), BODY),
    ];
  }

  function handOn(disc) {
    const found = HAND.map(balls => {
      const ends = balls.map(([x, y, z, radius]) => [seen(point(disc, hand * x, hand * y, hand * z)), hand * radius]);
      return [Math.max(...ends.map(([at]) => at[2])), shape(outline(ends.flatMap(([at, radius]) => ball(at, radius))), BODY)];
    });
    return hand > 0 ? fromAfar(found) : [];
  }
  const fromAfar = found => found.sort((a, b) => b[0] - a[0]).map(([, drawn]) => drawn);

  // Tendons and backbone between two neighbouring discs.
  function span(k, discs, bone, pull) {
    const found = tendons.map((tendon, t) => {
      const [a, b] = [k - 1, k].map(each => seen(point(discs[each], 0, 1e3 * tendon.y, 1e3 * tendon.z)));
      const dashes = pull[t] < 0.05 ? "2 2" : "none";
      return [a[2] + b[2], shape(line([a, b]), { stroke: tendon.colour, "stroke-width": 0.7 + 2.3 * pull[t] / most, "stroke-dasharray": dashes })];
    });
    const along = bone.map(each => seen(each.centre));
    return fromAfar([...found.filter((_, t) => tendons[t].discs > k), [along[0][2] + along.at(-1)[2], shape(line(along), { stroke: BLACK, "stroke-width": 2 })]]);
  }

  function disc(k, section, above) {
    const [upper, lower] = [thick / 2, -thick / 2].map(x => circle(section, rim, x)), x = above ? thick / 2 : -thick / 2;
    return [
      shape(outline([...upper, ...lower]), { fill: DARK, stroke: DARK, "stroke-width": 0.5 }),
      shape(line(above ? upper : lower) + "Z", { fill: "#F2F2F2", stroke: DARK, "stroke-width": 0.5 }),
      ...tendons.filter(tendon => tendon.discs === k + 1).map(tendon => dot(seen(point(section, x, 1e3 * tendon.y, 1e3 * tendon.z)), 1.5, tendon.colour)),
    ];
  }

  // From the farthest part to the nearest: each disc's plane parts what is below it from what is above.
  function body(q, pull) {
    const fine = sections(q, FINE * (wrist.discs - 1)), discs = fine.filter((_, k) => k % FINE === 0);
    const eye = [middle + far * Math.sin(elevation), far * Math.sin(azimuth) * Math.cos(elevation), -far * Math.cos(azimuth) * Math.cos(elevation)];
    let parts = handOn(discs.at(-1));
    for (let k = wrist.discs - 1; k >= 0; k--) {
      const above = times([add(eye, discs[k].centre, -1)], column(discs[k].frame, 0))[0] > 0, plate = disc(k, discs[k], above);
      const below = k ? span(k, discs, fine.slice(FINE * (k - 1), FINE * k + 1), pull) : [];
      parts = above ? [...below, ...plate, ...parts] : [...parts, ...plate, ...below];
    }
    return [parts, discs.at(-1)];
  }

  function show(instant) {
    const place = Math.min(instant / duration, 1) * last, low = Math.min(Math.floor(place), last - 1);
    const [q, goal, pull, tip, wantedTip] = [bends, wanted, pulls, tips, goals].map(rows => mixed(rows[low], rows[low + 1], place - low));
    const [parts, end] = body(q, pull), depth = seen(tip)[2], behind = [], before = [];
    const path = (points, style) => parted(points.map(seen), depth).forEach((d, side) => [behind, before][side].push(shape(d, style)));
    path(goals, { stroke: BAND, "stroke-width": 3 });
    path(tips, { stroke: GREEN, "stroke-width": 0.6, opacity: 0.6 });
    path([...tips.slice(0, low + 1), tip], { stroke: GREEN, "stroke-width": 1.4 });
    const drawn = [...onFloor(), ...behind, ...parts, ...before, dot(seen(tip), 2.2, GREEN)];

    while (pool.length < drawn.length) pool.push(element(shapes, "path"));
    pool.forEach((made, k) => {
      const { d, style } = drawn[k] || shape("", {});
      for (const [name, value] of Object.entries({ d, ...style })) made.setAttribute(name, value);
    });
    for (const [text, y, z] of labels) {
      const [right, down] = seen([floor, 1.15 * ground * y, 1.15 * ground * z]), [, lowest] = seen([floor, 0, 0]);
      const anchor = Math.abs(right) < 0.3 * ground ? "middle" : right > 0 ? "start" : "end";
      const shown = Math.hypot(right, down - lowest) > 0.4 * ground ? "visible" : "hidden";  // else it points at the reader
      for (const [name, value] of Object.entries({ x: right, y: down, "text-anchor": anchor, visibility: shown })) text.setAttribute(name, value);
    }
    if (pulled) weight.setAttribute("d", ofGravity());
    tell(end, goal, tip, wantedTip, pull, place);
  }

  const degrees = angle => `${(angle * 180 / Math.PI).toFixed(1).replace(/^-0\.0$/, "0.0")}\u00b0`;
  function tell({ frame }, goal, tip, wantedTip, pull, place) {
    const [x, y, z] = column(frame, 0), across = Math.hypot(y, z), per = across ? Math.atan2(across, x) / across : 0;
    const planes = [["ulnar", "radial", per * y, goal[0]], ["flexion", "extension", per * z, goal[1]]].map(([plus, minus, bend, aim]) =>
      bend < 0 ? `${degrees(-bend)} toward ${minus} (wanted ${degrees(-aim)})` : `${degrees(bend)} toward ${plus} (wanted ${degrees(aim)})`);
    const off = Math.hypot(...add(tip, wantedTip, -1));
    const lost = motion.left && place >= last ? "; there the wrist left its range" : "";
    said.textContent = `Bent ${planes.join(", ")}; the tip is ${off.toFixed(1)} mm from where it is wanted${lost}.`;
    forces.forEach(([text, name], k) => { text.textContent = `${name}: ${pull[k].toFixed(1)} N`; });
  }

  // The largest bend shows more than the straight wrist.
  const largest = wanted.reduce((best, each, k) => Math.hypot(...each) > Math.hypot(...wanted[best]) + 1e-3 ? k : best, 0);
  const redraw = player(duration, duration * largest / last, show);

  // Directions from which it is looked at [rad]: turned about its axis, from above.
  const right = Math.PI / 2, VIEWS = [
    ["obliquely", motion.from.azimuth, motion.from.elevation], ["from the back of the hand", 0, 0],
    ["from the little finger's side", right, 0], ["from the fingertips", 0, right],
  ];
  for (const [name] of VIEWS) views.append(new Option(name));
  const turnedByHand = views.appendChild(new Option("as it was turned"));
  turnedByHand.hidden = true;
  function look(at, above) {
    azimuth = at % (4 * right);
    elevation = Math.max(-0.2, Math.min(right, above));
    redraw();
  }
  function turn(by, up) {
    turnedByHand.hidden = false;
    turnedByHand.selected = true;
    look(azimuth + by, elevation + up);
  }
  function back() {
    const [, at, above] = VIEWS[views.selectedIndex] || VIEWS[0];
    look(at, above);
  }
  views.addEventListener("change", back);
  let grip = null;
  stage.addEventListener("pointerdown", event => { grip = [event.clientX, event.clientY]; stage.setPointerCapture(event.pointerId); });
  stage.addEventListener("pointermove", event => {
    if (grip === null) return;
    turn((grip[0] - event.clientX) / 150, (event.clientY - grip[1]) / 150);
    grip = [event.clientX, event.clientY];
  });
  for (const name of ["pointerup", "pointercancel"]) stage.addEventListener(name, () => { grip = null; });
  const STEP = Math.PI / 36, ARROWS = { ArrowLeft: [STEP, 0], ArrowRight: [-STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] };
  stage.addEventListener("keydown", event => {
    if (event.key === "Home") { views.selectedIndex = 0; back(); } else if (ARROWS[event.key]) turn(...ARROWS[event.key]); else return;
    event.preventDefault();
  });

  document.getElementById("animation").hidden = false;
  // Letters keep their size however wide the page is.
  new ResizeObserver(() => texts.setAttribute("font-size", 13 * 2 * wide / Math.max(stage.clientWidth, 1))).observe(stage);
  back();
}
