"use strict";
// Plays the wrist's bending from the logged segment angles; x along the base goes up, +y to the right, lengths in mm.
{
  const { wrist, step, duration, courses } = JSON.parse(document.getElementById("courses").textContent);
  const UNIT = 1e-4, SPACE = "http://www.w3.org/2000/svg", GREY = "#7F7F7F", WIDE = 600, HIGH = 200, EDGE = 8;
  const length = 1e3 * wrist.length, rim = 1250 * wrist.radius, reach = length + 2e3 * wrist.hand, half = 0.72 * reach;
  const groups = document.getElementById("group"), place = document.getElementById("wrists");
  let panels = [];

  const element = (name, attributes) => {
    const made = document.createElementNS(SPACE, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    return made;
  };

  // Along an arc that bends by an angle.
  function ahead([x, y, heading], arc, bend) {
    const half = bend / 2, chord = Math.abs(half) < 1e-6 ? arc : arc * Math.sin(half) / half;
    return [x + chord * Math.cos(heading + half), y + chord * Math.sin(heading + half), heading + bend];
  }
  // Points, with their directions, at equal lengths of a chain of arcs, or of parts with a hinge in the middle.
  function frames(theta, pieces, hinged) {
    const found = [], n = theta.length, size = length / n;
    const within = (base, bend, share) => {
      if (!hinged) return ahead(base, share * size, share * bend);
      const [x, y, heading] = ahead(base, Math.min(share, 0.5) * size, 0);
      return share > 0.5 ? ahead([x, y, heading + bend], (share - 0.5) * size, 0) : [x, y, heading];
    };
    let base = [0, 0, 0], part = 0;
    for (let k = 0; k <= pieces; k++) {
      for (; part < n - 1 && k / pieces * n >= part + 1 - 1e-9; part++) base = within(base, theta[part], 1);
      found.push(within(base, theta[part], k / pieces * n - part));
    }
    return found;
  }
  const spot = ([x, y, heading], across, along = 0) =>
    `${(y + across * Math.cos(heading) + along * Math.sin(heading)).toFixed(2)} ${(-x + across * Math.sin(heading) - along * Math.cos(heading)).toFixed(2)}`;
  const line = points => "M" + points.join("L");

  // The angles at a time, between the two pictures beside it; where a course has ended, its last.
  function at(pictures, time) {
    const place = Math.min(time / step, pictures.length - 1), low = Math.floor(place), share = place - low;
    const high = Math.min(low + 1, pictures.length - 1);
    const mix = (a, b) => UNIT * (a + share * (b - a));
    return Array.isArray(pictures[0]) ? pictures[low].map((a, k) => mix(a, pictures[high][k])) : mix(pictures[low], pictures[high]);
  }

  function panel(course) {
    const box = document.createElement("div"), title = document.createElement("p"), said = document.createElement("p");
    box.dataset.course = course.name;
    title.textContent = course.name;
    const height = reach + 20, svg = element("svg", { viewBox: `${-half} ${-reach - 6} ${2 * half} ${height}`, role: "img", "aria-label": course.name });
    const plot = element("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, preserveAspectRatio: "none", "aria-hidden": "true" });
    const part = (style, into = svg) => into.appendChild(element("path", { fill: "none", "stroke-linejoin": "round", ...style }));
    const shapes = {
      hand: part({ stroke: course.colour, "stroke-width": 1.5 * rim, "stroke-opacity": 0.18, "stroke-linecap": "round" }),
      wanted: part({ stroke: GREY, "stroke-width": 1.5, "stroke-dasharray": "4 3" }),
      tendons: part({ stroke: GREY, "stroke-width": 1 }),
      backbone: part({ stroke: course.colour, "stroke-width": 2.5 }),
      discs: part({ stroke: "#000", "stroke-width": 3.5, "stroke-linecap": "round" }),
    };
    if (wrist.gravity) {
      const ahead = -Math.sign(wrist.gravity) * 0.09 * reach, x = -0.8 * half, y = -0.86 * reach, tip = y + ahead;
      const head = [-1, 1].map(side => `M${x} ${tip}L${x + side * 0.03 * reach} ${tip - 0.4 * ahead}`).join("");
      part({ stroke: GREY, "stroke-width": 1, "stroke-linecap": "round", d: `M${x} ${y - ahead}L${x} ${tip}${head}` });
      const name = svg.appendChild(element("text", { x, y: -0.68 * reach, fill: GREY, "font-size": 0.07 * reach, "text-anchor": "middle" }));
      name.textContent = "gravity";
    }
    const sums = course.theta.map(angles => angles.reduce((a, b) => a + b, 0));
    const all = [...course.wanted, ...course.wanted.map(angle => 1.5 * angle), 0];
    const low = Math.min(...all), high = Math.max(...all, low + 1);
    const across = k => EDGE + (WIDE - 2 * EDGE) * k * step / duration;
    const up = angle => EDGE + (HIGH - 2 * EDGE) * (1 - (Math.max(low, Math.min(high, angle)) - low) / (high - low));
    const curve = angles => line(angles.map((angle, k) => `${across(k).toFixed(1)} ${up(angle).toFixed(1)}`));
    part({ stroke: GREY, "stroke-dasharray": "4 3", "stroke-width": 1, d: curve(course.wanted) }, plot);
    part({ stroke: course.colour, "stroke-width": 1.5, d: curve(sums.length ? sums : [0]) }, plot);
    const cursor = part({ stroke: "#000", "stroke-width": 1 }, plot);
    const drawn = document.createElement("div");
    drawn.className = "drawn";
    const beside = document.createElement("div");
    beside.className = "plot";
    beside.append(plot);
    drawn.append(svg, beside);
    box.append(title, drawn, said);
    place.append(box);

    return time => {
      const ended = course.diverged && time > (course.theta.length - 1) * step;
      const theta = course.theta.length ? at(course.theta, time) : [0], wanted = at(course.wanted, time);
      const bent = frames(theta, 4 * (wrist.discs - 1), course.hinged), plates = bent.filter((_, k) => k % 4 === 0), tip = bent.at(-1);
      shapes.backbone.setAttribute("d", line(bent.map(frame => spot(frame, 0))));
      shapes.discs.setAttribute("d", plates.map(frame => line([spot(frame, -rim), spot(frame, rim)])).join(""));
      shapes.tendons.setAttribute("d", [-1, 1].map(side => line(plates.map(frame => spot(frame, side * 1e3 * wrist.offset)))).join(""));
      shapes.hand.setAttribute("d", line([spot(tip, 0, 0.8 * rim), spot(tip, 0, Math.max(0.8 * rim, 2e3 * wrist.hand - 0.8 * rim))]));
      const goal = frames([wanted], 16, false);
      shapes.wanted.setAttribute("d", line([...goal.map(frame => spot(frame, 0)), spot(goal.at(-1), 0, 2e3 * wrist.hand)]));
      cursor.setAttribute("d", `M${across(time / step)} 0V${HIGH}`);
      const degrees = theta.reduce((a, b) => a + b, 0) * 180 / Math.PI;
      said.textContent = ended ? "diverged" : `${degrees.toFixed(1)}°, wanted ${(wanted * 180 / Math.PI).toFixed(1)}°`;
    };
  }

  const draw = player(duration, duration / 4, instant => {  // where a move shows, not all straight
    for (const drawn of panels) drawn(instant);
  });
  groups.addEventListener("change", fill);

  function fill() {
    place.replaceChildren();
    panels = courses.filter(course => course.group === groups.value).map(panel);
    draw();
  }
  for (const name of new Set(courses.map(course => course.group))) groups.append(new Option(name, name));
  groups.hidden = groups.options.length < 2;
  fill();
}
