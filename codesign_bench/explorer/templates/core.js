"use strict";
// The computations of the page, without any drawing: unpacking numbers, designers, tools, recorded episodes.
// They run in a browser and in Node.js alike.
const core = (() => {
  async function unpack(text) {
    const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new DataView(await new Response(stream).arrayBuffer());
  }

  function singles(view, start, count) {
    const values = new Float64Array(count);
    for (let i = 0; i < count; i++) values[i] = view.getFloat32(start + 4 * i, true);
    return values;
  }

  async function unpackSingles(text) {
    const view = await unpack(text);
    return singles(view, 0, view.byteLength / 4);
  }

  // Integers from planes: all lowest bytes, then all next bytes, and so on; negative ones in two's complement.
  function fromPlanes(view, start, count, planes) {
    const values = new Int32Array(count);
    for (let plane = 0; plane < planes; plane++)
      for (let i = 0; i < count; i++) values[i] |= view.getUint8(start + plane * count + i) << (8 * plane);
    const spare = 32 - 8 * planes;
    for (let i = 0; i < count; i++) values[i] = (values[i] << spare) >> spare;
    return values;
  }

  // --- functions of the goal ---------------------------------------------------------------------------------------

  function nearestIndex(values, value) {
    let best = 0;
    values.forEach((other, index) => {
      if (Math.abs(other - value) < Math.abs(values[best] - value)) best = index;
    });
    return best;
  }

  async function loadFunction(task, packed) {
    const coefficients = await unpackSingles(packed.coefficients);
    const [, terms, features] = packed.shape;
    const smooth = task.axes.map((_, index) => index).filter((index) => !task.axes[index].values.length);
    return (point) => {
      let combination = 0;
      task.axes.forEach((axis, index) => {
        if (axis.values.length)
          combination = combination * axis.values.length + nearestIndex(axis.values, point[index]);
      });
      const angles = smooth.map((index) => {
        const { low, high } = task.axes[index];
        return Math.acos(Math.min(1, Math.max(-1, (2 * point[index] - low - high) / (high - low))));
      });
      const result = new Float64Array(features);
      packed.exponents.forEach((exponents, term) => {
        let factor = 1;
        exponents.forEach((degree, place) => (factor *= Math.cos(degree * angles[place])));
        const start = (combination * terms + term) * features;
        for (let i = 0; i < features; i++) result[i] += factor * coefficients[start + i];
      });
      return result.map(Math.fround);
    };
  }

  // --- designers ---------------------------------------------------------------------------------------------------

  const pairs = {
    add: (a, b) => a + b,
    subtract: (a, b) => a - b,
    multiply: (a, b) => a * b,
    divide: (a, b) => a / b,
  };
  const singleOperands = {
    relu: (x) => Math.max(x, 0),
    sigmoid: (x) => 1 / (1 + Math.exp(-x)),
    tanh: Math.tanh,
    exp: Math.exp,
  };

  function product(left, right, batch, rows, inner, columns) {
    const result = new Float64Array(batch * rows * columns);
    for (let b = 0; b < batch; b++)
      for (let row = 0; row < rows; row++)
        for (let k = 0; k < inner; k++) {
          const factor = left[(b * rows + row) * inner + k];
          if (factor === 0) continue;
          const from = (b * inner + k) * columns;
          const to = (b * rows + row) * columns;
          for (let column = 0; column < columns; column++) result[to + column] += factor * right[from + column];
        }
    return result;
  }

  function run(operations, constants, observation) {
    const values = [observation];
    for (const [name, ...operands] of operations.slice(1)) {
      let value;
      if (name === "constant") value = constants[operands[0]];
      else if (name === "take") value = Float64Array.from(operands[1], (place) => values[operands[0]][place]);
      else if (name === "join") value = Float64Array.from(operands.flatMap((operand) => Array.from(values[operand])));
      else if (name === "product") value = product(values[operands[0]], values[operands[1]], ...operands.slice(2));
      else if (name === "clamp")
        value = values[operands[0]].map((x) => Math.min(operands[2], Math.max(operands[1], x)));
      else if (name in pairs) value = values[operands[0]].map((x, i) => pairs[name](x, values[operands[1]][i]));
      else value = values[operands[0]].map(singleOperands[name]);
      values.push(value);
    }
    return values[values.length - 1];
  }

  async function loadNetwork(packed, observe) {
    const view = await unpack(packed.content);
    let start = 0;
    const constants = packed.constants.map(([count, step]) => {
      if (step) return null;
      const values = singles(view, start, count);
      start += 4 * count;
      return values;
    });
    packed.constants.forEach(([count, step], index) => {
      if (!step) return;
      constants[index] = Float64Array.from(fromPlanes(view, start, count, packed.planes), (value) => value * step);
      start += count * packed.planes;
    });
    return (point) => run(packed.operations, constants, Float64Array.from(observe(point)));
  }

  async function loadGrid(packed) {
    const designs = await unpackSingles(packed.designs);
    const size = designs.length / packed.places.reduce((count, places) => count * places.length, 1);
    return (point) => {
      let corners = [[0, 1]];
      packed.places.forEach((places, axis) => {
        let low = 0;
        while (low < places.length - 2 && places[low + 1] <= point[axis]) low++;
        const high = Math.min(low + 1, places.length - 1);
        const width = places[high] - places[low] || 1;
        const share = Math.min(1, Math.max(0, (point[axis] - places[low]) / width));
        corners = corners.flatMap(([index, weight]) => [
          [index * places.length + low, weight * (1 - share)],
          [index * places.length + high, weight * share],
        ]);
      });
      const design = new Float64Array(size);
      for (const [index, weight] of corners)
        for (let i = 0; i < size; i++) design[i] += weight * designs[index * size + i];
      return design;
    };
  }

  // Returns a function from a point to the normalised design.
  async function loadDesigner(packed, observe) {
    if (packed.kind === "network") return loadNetwork(packed, observe);
    if (packed.kind === "grid") return loadGrid(packed);
    const design = Float64Array.from(packed.design);
    return () => design;
  }

  function inUnits(space, design) {
    return Array.from(design, (value, i) => space.low[i] + 0.5 * (value + 1) * (space.high[i] - space.low[i]));
  }

  // --- tools -------------------------------------------------------------------------------------------------------

  // Returns the values of all parts of the tool: see tools.py.
  function toolValues(tool, design) {
    const plain = [1, ...design];
    const angles = tool.angles.map((row) => row.reduce((sum, slope, i) => sum + slope * plain[i], 0));
    const waves = [1, ...angles.map(Math.cos), ...angles.map(Math.sin)];
    const values = new Float64Array(tool.count);
    for (const [row, column, weight] of tool.weights)
      values[row] += weight * plain[Math.floor(column / waves.length)] * waves[column % waves.length];
    return values;
  }

  // --- recorded episodes -------------------------------------------------------------------------------------------

  async function loadFrames(task, packed) {
    const view = await unpack(packed.content);
    const steps = fromPlanes(view, 0, view.byteLength / 2, 2);
    let start = 0;
    return packed.structures.map((runs) => {
      const frames = [];
      for (const [structure, count] of runs) {
        const { items, tool } = task.structures[structure];
        const width = items.reduce((sum, item) => sum + item.pose, tool);
        const poses = Array.from({ length: count }, () => new Float64Array(width));
        for (let i = 0; i < width; i++) {
          let value = 0;
          for (let frame = 0; frame < count; frame++) {
            value = ((value + steps[start + i * count + frame]) << 16) >> 16;
            poses[frame][i] = value * packed.unit;
          }
        }
        start += width * count;
        for (const pose of poses) frames.push({ structure, pose });
      }
      return frames;
    });
  }

  // Returns the recorded point nearest to `point`; values of a list come first, then distances in widths of the axes.
  function nearestPoint(task, point) {
    let best = 0;
    let least = Infinity;
    task.points.forEach((other, index) => {
      let distance = 0;
      task.axes.forEach((axis, i) => {
        const share = (other[i] - point[i]) / (axis.high - axis.low || 1);
        distance += (axis.values.length ? 1e6 : 1) * share * share;
      });
      if (distance < least) [best, least] = [index, distance];
    });
    return best;
  }

  // Returns a task with everything that its cells share, ready to use.
  async function loadTask(task) {
    return {
      ...task,
      observe: await loadFunction(task, task.observation),
      startScene: task.start && (await loadFunction(task, task.start)),
    };
  }

  // Returns a cell with its designer, designs and frames, ready to use.
  async function loadCell(task, cell) {
    return {
      ...cell,
      design: await loadDesigner(cell.designer, task.observe),
      recordedDesigns: await unpackSingles(cell.designs),
      recordedParts: cell.parts && (await unpackSingles(cell.parts.values)),
      episodes: cell.frames && (await loadFrames(task, cell.frames)),
    };
  }

  return { loadTask, loadCell, inUnits, toolValues, nearestPoint, nearestIndex };
})();
