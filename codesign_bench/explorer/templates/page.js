"use strict";
// The page: controls, panels, dragging and playing. All computations are in core.js, all drawing of scenes in draw.js.
const page = (() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const get = (id) => document.getElementById(id);
  const state = { task: null, point: [], time: 0, playing: false, started: 0 };
  const panels = ["a", "b"].map((name) => ({ name, cell: null, root: get(`panel-${name}`) }));
  const loaded = { tasks: new Map(), cells: new Map() };

  function make(tag, attributes = {}, text = "") {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.textContent = text;
    return element;
  }

  const part = (panel, name) => panel.root.querySelector(`[data-part="${name}"]`);
  const number = (value) =>
    (Number.isInteger(value) || Math.abs(value) >= 100 ? value.toFixed(0) : value.toPrecision(3)).replace("-", "−");
  const words = (name) => name.replaceAll("_", " ");
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  // A unit such as "0.18 m" is a multiple of one.
  const withUnit = (value, unit) => number(value) + (unit && unit !== "1" ? (/^[0-9]/.test(unit) ? ` × ${unit}` : ` ${unit}`) : "");

  function place(point) {
    return state.task.axes
      .map((axis, i) => (axis.name === "variation" ? `variation ${point[i] + 1}` : `${words(axis.name)} ${withUnit(point[i], axis.unit)}`))
      .join(", ");
  }

  // --- tasks and cells ---------------------------------------------------------------------------------------------

  async function chooseTask(index) {
    state.wanted = index;
    if (!loaded.tasks.has(index)) loaded.tasks.set(index, await core.loadTask(data.tasks[index]));
    if (state.wanted !== index) return;
    const task = (state.task = loaded.tasks.get(index));
    for (const panel of panels) panel.cell = null; // until both are of this task, nothing is drawn
    state.time = 0;
    pause();
    task.extent = null;
    task.handle = handleOf(task);
    for (const panel of panels) part(panel, "scene").classList.toggle("draggable", task.handle !== null);
    get("outside").hidden = !task.mask;
    state.point = [...task.points[Math.floor(task.points.length / 2)]];
    get("axes").replaceChildren(...task.axes.map(slider));
    const methods = [...new Set(task.cells.map((cell) => cell.method))];
    for (const [place, panel] of panels.entries()) {
      const labels = methods.map((method) => task.cells.find((cell) => cell.method === method).label);
      const before = part(panel, "method").value;
      part(panel, "method").replaceChildren(...methods.map((method, i) => make("option", { value: method }, labels[i])));
      part(panel, "method").value = methods.includes(before) ? before : methods[Math.min(place, methods.length - 1)];
      chooseSeeds(panel);
    }
    get("solved-when").textContent = task.success.length ? `Solved: ${task.success.join("; ")}.` : "";
    await Promise.all(panels.map(chooseCell));
  }

  // The item of the scene that is where the goal is, if there is one: then the goal can be dragged in the scene itself.
  function handleOf(task) {
    const [across, up] = task.axes;
    if (!task.startScene || !up || across.values.length || up.values.length) return null;
    const shown = [0.3, 0.8].map((at) => {
      const point = task.points[0].map((value, i) => (i > 1 ? value : task.axes[i].low + at * (task.axes[i].high - task.axes[i].low)));
      return { point, items: draw.itemsOfStart(task.start, task.startScene(point)) };
    });
    const near = 1e-3 * (across.high - across.low);
    const index = shown[0].items.findIndex((_, i) =>
      shown.every(({ point, items }) => items[i].pose.length && [0, 1].every((k) => Math.abs(items[i].pose[k] - point[k]) < near)));
    if (index < 0) return null;
    const { pose, shapes } = shown[0].items[index];
    const height = task.view.eye ? pose[2] : 0;
    return { height, ground: height - (shapes[0].kind === "box" ? shapes[0].size[2] : 0) + 1e-3 };
  }

  // The recorded goals as fields on the ground of the scene, with the colours of the map.
  function fields(panel) {
    const { task, point } = state;
    const [width, depth] = [0, 1].map((i) => (task.axes[i].high - task.axes[i].low) / task.places[i].length);
    return task.points.flatMap((other, index) => {
      if (hidden(other, point)) return [];
      const colour = style(panel.cell.success[index] ? "--solved" : "--missed");
      const around = (value, size) => [value - 0.47 * size, value + 0.47 * size];
      return [draw.field(task.view, around(other[0], width), around(other[1], depth), task.handle.ground, colour)];
    });
  }

  // Whether a recorded goal is on another map than the shown one: other values of the third axis or a later one.
  const hidden = (other, point) =>
    state.task.axes.some((_, i) => i > 1 &&
      core.nearestIndex(state.task.places[i], other[i]) !== core.nearestIndex(state.task.places[i], point[i]));

  function slider(axis, index) {
    const row = make("label", { class: "axis" });
    const listed = axis.values.length > 0;
    const input = make("input", {
      type: "range",
      min: listed ? 0 : axis.low,
      max: listed ? axis.values.length - 1 : axis.high,
      step: listed ? 1 : "any",
    });
    input.addEventListener("input", () => {
      const value = Number(input.value);
      moveTo(state.point.map((other, i) => (i === index ? (listed ? axis.values[value] : value) : other)));
    });
    if (!listed) input.addEventListener("keydown", (event) => steps(event, index));
    row.append(make("span", {}, words(axis.name)), input, make("output"));
    return row;
  }

  // A slider without steps moves by a tiny amount per key; a fortieth of the axis is useful.
  function steps(event, index) {
    const step = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -5, PageUp: 5 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    shift(index, step);
  }

  function shift(index, step) {
    const axis = state.task.axes[index];
    const point = [...state.point];
    if (axis.values.length) {
      const at = core.nearestIndex(axis.values, point[index]) + Math.sign(step);
      point[index] = axis.values[Math.min(axis.values.length - 1, Math.max(0, at))];
    } else point[index] = Math.min(axis.high, Math.max(axis.low, point[index] + (step * (axis.high - axis.low)) / 40));
    moveTo(point);
  }

  function chooseSeeds(panel) {
    const method = part(panel, "method").value;
    const seeds = state.task.cells.filter((cell) => cell.method === method).map((cell) => cell.seed);
    const before = part(panel, "seed").value;
    part(panel, "seed").replaceChildren(...seeds.map((seed) => make("option", { value: seed }, String(seed))));
    part(panel, "seed").value = seeds.map(String).includes(before) ? before : seeds[0];
  }

  async function chooseCell(panel) {
    const [method, seed] = [part(panel, "method").value, Number(part(panel, "seed").value)];
    const task = state.task;
    const cell = task.cells.find((other) => other.method === method && other.seed === seed);
    if (!loaded.cells.has(cell)) loaded.cells.set(cell, await core.loadCell(task, cell));
    if (state.task !== task) return;
    panel.cell = loaded.cells.get(cell);
    const kinds = {
      network: "The designer’s network runs in this page.",
      one: "This method makes one tool for all goals.",
      grid: "This designer cannot run in a page: designs are interpolated between designs on a grid of goals" +
        `; they are off by up to ${number(cell.designer.error)} of a parameter’s half range.`,
    };
    const solved = cell.success.reduce((sum, value) => sum + value, 0);
    part(panel, "about").textContent =
      `${kinds[cell.designer.kind]} Solved ${solved} of ${cell.success.length} recorded goals after ${cell.steps.toLocaleString("en")} steps of training.`;
    show();
  }

  // --- goal and time -----------------------------------------------------------------------------------------------

  function moveTo(point) {
    state.point = point;
    state.time = 0;
    pause();
    show();
  }

  const duration = () =>
    Math.max(0, ...panels.map(({ cell }) => (cell && cell.episodes ? (frames(cell).length - 1) * state.task.period : 0)));
  const frames = (cell) => cell.episodes[core.nearestPoint(state.task, state.point)];

  function play() {
    if (state.playing) return pause();
    if (state.time >= duration()) state.time = 0;
    state.playing = true;
    state.moment = performance.now();
    get("play").textContent = "Pause";
    requestAnimationFrame(tick);
  }

  function pause() {
    state.playing = false;
    get("play").textContent = "Play";
  }

  function tick(now) {
    if (!state.playing) return;
    state.time = Math.min(duration(), state.time + Math.max(0, now - state.moment) / 1000);
    state.moment = now;
    if (state.time >= duration()) pause();
    show();
    if (state.playing) requestAnimationFrame(tick);
  }

  // --- showing -----------------------------------------------------------------------------------------------------

  function show() {
    const { task, point } = state;
    if (!task || panels.some((panel) => !panel.cell)) return;
    [...get("axes").children].forEach((row, i) => {
      const axis = task.axes[i];
      const [, input, output] = row.children;
      input.value = axis.values.length ? core.nearestIndex(axis.values, point[i]) : point[i];
      output.textContent = axis.name === "variation" ? `${point[i] + 1} of ${axis.values.length}` : withUnit(point[i], axis.unit);
      input.setAttribute("aria-valuetext", output.textContent);
    });
    const end = duration();
    get("time").max = end;
    get("time").value = state.time;
    get("time").disabled = get("play").disabled = end === 0;
    get("clock").textContent = `${state.time.toFixed(1)} of ${end.toFixed(1)} s`;
    for (const panel of panels) showPanel(panel);
  }

  function showPanel(panel) {
    const { task, point } = state;
    const nearest = core.nearestPoint(task, point);
    const live = state.time === 0 && !state.playing;
    const size = task.design.names.length;
    const recorded = panel.cell.recordedDesigns.slice(nearest * size, (nearest + 1) * size);
    const design = live ? panel.cell.design(point) : recorded;
    panel.design = design;
    const values = toolOf(panel.cell, design, nearest);
    drawScene(panel, nearest, live, values);
    drawMap(panel, nearest, values);
    showDesign(panel, design);
    const solved = panel.cell.success[nearest] ? "solved" : "not solved";
    const same = task.axes.every((axis, i) => Math.abs(task.points[nearest][i] - point[i]) < 1e-9 * (1 + Math.abs(point[i])));
    const where = same ? "The recorded episode of this goal" : `The nearest recorded goal, ${place(task.points[nearest])},`;
    const message = live
      ? `${where}: ${solved} in ${panel.cell.lengths[nearest]} control steps, return ${number(panel.cell.returns[nearest])}.`
      : `Shown: ${same ? "the recorded episode of this goal" : `the recorded episode of the nearest goal, ${place(task.points[nearest])}`}, ${solved}.`;
    if (part(panel, "status").textContent !== message) part(panel, "status").textContent = message;
  }

  function toolOf(cell, design, nearest) {
    const { tool } = state.task;
    if (tool) return core.toolValues(tool, design);
    return cell.parts && cell.recordedParts.slice(nearest * cell.parts.count, (nearest + 1) * cell.parts.count);
  }

  const toolKind = (cell) => (state.task.tool || cell.parts || {}).kind;

  function canvasOf(panel, name, aspect) {
    const canvas = part(panel, name);
    const width = Math.max(200, canvas.clientWidth);
    const density = Math.min(2, devicePixelRatio || 1);
    const [across, down] = [Math.round(width * density), Math.round((width * density) / aspect)];
    if (canvas.width !== across || canvas.height !== down) [canvas.width, canvas.height] = [across, down];
    const context = canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, across, down);
    return { canvas, context, box: { x: 0, y: 0, width: across, height: down }, density };
  }

  function drawScene(panel, nearest, live, values) {
    const { task, point } = state;
    const { view } = task;
    part(panel, "scene").hidden = !view;
    if (!view) return;
    const aspect = view.eye ? view.aspect : (view.x[1] - view.x[0]) / (view.y[1] - view.y[0]);
    const { canvas, context, box } = canvasOf(panel, "scene", Math.max(1, aspect));
    const own = panel.cell.episodes[nearest];
    const frame = own[live ? 0 : Math.min(own.length - 1, Math.floor(state.time / task.period + 1e-6))];
    const { items, toolPose } = draw.itemsOfFrame(task.structures[frame.structure], frame.pose);
    const scene = live && task.startScene ? draw.itemsOfStart(task.start, task.startScene(point), items) : items;
    const tool = values && toolPose.length ? [draw.toolItem(toolKind(panel.cell), values, toolPose, task.colour)] : [];
    panel.sceneBox = box;
    draw.scene(context, box, view, [...(task.handle ? fields(panel) : []), ...scene, ...tool]);
    canvas.setAttribute("aria-label", `${task.title}, ${panel.cell.label}, seed ${panel.cell.seed}: ` +
      (live ? `the tool for ${place(point)}, at the start` : `the episode after ${state.time.toFixed(1)} s`));
  }

  // Size of all recorded tools, and the plane in which they are widest.
  function extentOf(panel) {
    const { task } = state;
    if (task.extent) return task.extent;
    const [low, high] = [[0, 0, 0], [0, 0, 0]];
    const size = task.design.names.length;
    for (let i = 0; i < task.points.length; i++) {
      const design = panel.cell.recordedDesigns.slice(i * size, (i + 1) * size);
      const item = draw.toolItem(toolKind(panel.cell), toolOf(panel.cell, design, i), [], task.colour);
      for (const { points } of item.shapes)
        for (let k = 0; k < points.length; k++) {
          const axis = toolKind(panel.cell) === "planar" ? k % 2 : k;
          low[axis] = Math.min(low[axis], points[k]);
          high[axis] = Math.max(high[axis], points[k]);
        }
    }
    const widths = high.map((value, axis) => value - low[axis]);
    const plane = [0, 1, 2].sort((one, two) => widths[two] - widths[one]).slice(0, 2).sort();
    return (task.extent = {
      plane,
      width: Math.max(widths[plane[0]], widths[plane[1]]) / 2 + 0.5 * Math.min(widths[plane[0]], widths[plane[1]]),
    });
  }

  // --- the map of goals --------------------------------------------------------------------------------------------

  // Returns the share of the map's side at which a value of an axis is; listed values are in the middles of fields.
  function share(axis, value) {
    if (!axis) return 0.5;
    if (axis.values.length) return (core.nearestIndex(axis.values, value) + 0.5) / axis.values.length;
    return (value - axis.low) / (axis.high - axis.low || 1);
  }

  function valueAt(axis, at) {
    const inside = Math.min(1, Math.max(0, at));
    if (axis.values.length) return axis.values[Math.min(axis.values.length - 1, Math.floor(inside * axis.values.length))];
    return axis.low + inside * (axis.high - axis.low);
  }

  function drawMap(panel, nearest, values) {
    const { task, point } = state;
    const [across, up] = task.axes;
    const drawn = canvasOf(panel, "map", up ? 1.25 : 4);
    const { canvas, context, density } = drawn;
    const pad = { left: 58 * density, bottom: 34 * density, top: 8 * density, right: 8 * density };
    const area = {
      x: pad.left, y: pad.top, width: canvas.width - pad.left - pad.right, height: canvas.height - pad.top - pad.bottom,
    };
    panel.area = { ...area, density };
    const at = (other) => [area.x + share(across, other[0]) * area.width, area.y + (1 - share(up, up ? other[1] : 0)) * area.height];
    context.fillStyle = style("--shade");
    context.fillRect(area.x, area.y, area.width, area.height);
    if (task.mask) drawOutside(context, area, task.mask);
    const [columns, rows] = [task.places[0].length, up ? task.places[1].length : 1];
    const [width, height] = [area.width / columns, area.height / rows];
    task.points.forEach((other, index) => {
      if (hidden(other, point)) return;
      const [x, y] = at(other);
      const solved = panel.cell.success[index];
      context.fillStyle = style(solved ? "--solved" : "--missed");
      context.fillRect(x - 0.5 * width + density, y - 0.5 * height + density, width - 2 * density, height - 2 * density);
      if (!solved) {
        // A cross as well as a colour: not everybody tells the colours apart.
        context.strokeStyle = style("--soft");
        context.lineWidth = density;
        const arm = 3 * density;
        context.beginPath();
        context.moveTo(x - arm, y - arm);
        context.lineTo(x + arm, y + arm);
        context.moveTo(x - arm, y + arm);
        context.lineTo(x + arm, y - arm);
        context.stroke();
      }
    });
    const [nearX, nearY] = at(task.points[nearest]);
    context.strokeStyle = style("--ink");
    context.lineWidth = 2 * density;
    context.strokeRect(nearX - 0.5 * width + density, nearY - 0.5 * height + density, width - 2 * density, height - 2 * density);
    drawAxes(context, area, across, up, density);
    const [x, y] = at(point);
    if (values) {
      const extent = extentOf(panel);
      const scale = (0.28 * Math.min(area.width, area.height)) / (extent.width || 1);
      context.globalAlpha = 0.82;
      draw.tool(context, toolKind(panel.cell), values, [x, y], extent, scale, task.colour);
      context.globalAlpha = 1;
    }
    context.beginPath();
    context.arc(x, y, 6 * density, 0, 2 * Math.PI);
    context.fillStyle = style("--paper");
    context.fill();
    context.strokeStyle = style("--ink");
    context.lineWidth = 2 * density;
    context.stroke();
    const solved = panel.cell.success[nearest] ? "solved" : "not solved";
    canvas.setAttribute("aria-label",
      `Map of goals for ${panel.cell.label}, seed ${panel.cell.seed}. Goal: ${place(point)}. Nearest recorded goal: ${solved}. Drag, or use the arrow keys.`);
  }

  function drawOutside(context, area, mask) {
    mask.bytes ??= Uint8Array.from(atob(mask.bits), (character) => character.charCodeAt(0));
    const side = mask.side;
    context.fillStyle = style("--outside");
    for (let row = 0; row < side; row++)
      for (let column = 0; column < side; column++) {
        const bit = row * side + column;
        if (mask.bytes[bit >> 3] & (128 >> (bit & 7))) continue;
        context.fillRect(area.x + (column * area.width) / side, area.y + ((side - 1 - row) * area.height) / side,
          area.width / side + 1, area.height / side + 1);
      }
  }

  function drawAxes(context, area, across, up, density) {
    context.fillStyle = style("--soft");
    context.font = `${12 * density}px system-ui, sans-serif`;
    const label = (axis) => words(axis.name) + (axis.unit && axis.unit !== "1" ? ` (${axis.unit})` : "");
    const ticks = (axis) =>
      axis.values.length
        ? axis.values.map((value) => [share(axis, value), axis.name === "variation" ? value + 1 : value])
        : [0, 0.5, 1].map((at) => [at, axis.low + at * (axis.high - axis.low)]);
    context.textBaseline = "top";
    for (const [at, value] of ticks(across)) {
      context.textAlign = at === 0 ? "left" : at === 1 ? "right" : "center";
      context.fillText(String(Number(value.toPrecision(3))), area.x + at * area.width, area.y + area.height + 3 * density);
    }
    context.textAlign = "center";
    context.fillText(label(across), area.x + 0.5 * area.width, area.y + area.height + 18 * density);
    if (!up) return;
    context.textBaseline = "middle";
    context.textAlign = "right";
    for (const [at, value] of ticks(up)) {
      const y = area.y + (1 - at) * area.height + (at === 0 ? -6 : at === 1 ? 6 : 0) * density;
      context.fillText(String(Number(value.toPrecision(3))), area.x - 4 * density, y);
    }
    context.save();
    context.translate(9 * density, area.y + 0.5 * area.height);
    context.rotate(-0.5 * Math.PI);
    context.textAlign = "center";
    context.fillText(label(up), 0, 0);
    context.restore();
  }

  function showDesign(panel, design) {
    const { design: space } = state.task;
    const values = core.inUnits(space, design);
    const body = part(panel, "design");
    if (body.children.length !== values.length || panel.space !== space) {
      panel.space = space;
      body.replaceChildren(
        ...space.names.map((name) => {
          const row = make("tr");
          const bar = make("td", { class: "bar" });
          bar.append(make("div", { "aria-hidden": "true" }));
          row.append(make("th", { scope: "row" }, words(name)), make("td", { class: "number" }), bar);
          return row;
        }),
      );
    }
    values.forEach((value, i) => {
      const [, cell, bar] = body.children[i].children;
      cell.textContent = withUnit(value, space.units[i]);
      bar.firstChild.style.width = `${(50 * (design[i] + 1)).toFixed(1)}%`;
    });
  }

  // --- what a person does ------------------------------------------------------------------------------------------

  function pixel(canvas, event) {
    const bounds = canvas.getBoundingClientRect();
    return [
      ((event.clientX - bounds.left) * canvas.width) / bounds.width,
      ((event.clientY - bounds.top) * canvas.height) / bounds.height,
    ];
  }

  function dragMap(panel, event) {
    const [left, top] = pixel(part(panel, "map"), event);
    const { x, y, width, height } = panel.area;
    const [across, up] = state.task.axes;
    const point = [...state.point];
    point[0] = valueAt(across, (left - x) / width);
    if (up) point[1] = valueAt(up, 1 - (top - y) / height);
    moveTo(point);
  }

  function dragScene(panel, event) {
    const { view, handle, axes } = state.task;
    if (!handle) return;
    const place = draw.placeAt(panel.sceneBox, view, pixel(part(panel, "scene"), event), handle.height);
    moveTo(state.point.map((value, i) => (i > 1 ? value : Math.min(axes[i].high, Math.max(axes[i].low, place[i])))));
  }

  function draggable(panel, canvas, drag) {
    let dragging = false;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      dragging = true;
      if (canvas.tabIndex >= 0) canvas.focus({ preventScroll: true });
      drag(panel, event);
    });
    canvas.addEventListener("pointermove", (event) => dragging && drag(panel, event));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => (dragging = false));
  }

  function listen(panel) {
    part(panel, "method").addEventListener("change", () => {
      chooseSeeds(panel);
      chooseCell(panel);
    });
    part(panel, "seed").addEventListener("change", () => chooseCell(panel));
    const map = part(panel, "map");
    draggable(panel, map, dragMap);
    draggable(panel, part(panel, "scene"), dragScene);
    map.addEventListener("keydown", (event) => {
      const [index, step] = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowDown: [1, -1], ArrowUp: [1, 1] }[event.key] || [];
      if (index === undefined || index >= state.task.axes.length) return;
      event.preventDefault();
      shift(index, step);
    });
  }

  async function begin() {
    get("task").replaceChildren(...data.tasks.map((task, i) => make("option", { value: i }, task.title)));
    get("task").addEventListener("change", () => chooseTask(Number(get("task").value)));
    get("play").addEventListener("click", play);
    get("time").addEventListener("input", () => {
      pause();
      state.time = Number(get("time").value);
      show();
    });
    get("end").addEventListener("click", () => {
      pause();
      state.time = duration();
      show();
    });
    panels.forEach(listen);
    new ResizeObserver(() => show()).observe(get("panels"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", show);
    await chooseTask(0);
    document.documentElement.dataset.ready = "yes";
  }

  begin();
  return { data, state, panels, moveTo };
})();
