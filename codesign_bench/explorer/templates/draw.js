"use strict";
// Drawing of scenes: flat ones on a canvas, scenes in space with a depth buffer.
const draw = (() => {
  // Items with absolute numbers, from a recorded frame or from the start scene's numbers.
  function itemsOfFrame(structure, pose) {
    let start = 0;
    const items = structure.items.map((item) => {
      const own = pose.slice(start, start + item.pose);
      start += item.pose;
      const shapes = item.shapes.map(([kind, colour, points, size, rotation]) => ({ kind, colour, points, size, rotation }));
      return { pose: own, shapes };
    });
    return { items, toolPose: pose.slice(start, start + structure.tool) };
  }

  // Items that are not known for every goal are those of the nearest recorded episode, `recorded`.
  function itemsOfStart(start, numbers, recorded = []) {
    let place = 0;
    const next = (count) => Array.from(numbers.slice(place, (place += count)));
    return start.items.map((item, i) => !item.known ? recorded[i] || { pose: [], shapes: [] } : ({
      pose: next(item.pose),
      shapes: item.shapes.map(([kind, colour, points, size, rotation]) => ({
        kind, colour, points: next(points), size: next(size), rotation,
      })),
    }));
  }

  function toolItem(kind, values, pose, colour) {
    const shapes = [];
    const width = kind === "planar" ? 5 : 15;
    for (let i = 0; i < values.length; i += width) {
      const part = Array.from(values.slice(i, i + width));
      if (kind === "planar") shapes.push({ kind: "segment", colour, points: part.slice(0, 4), size: [part[4]] });
      else shapes.push({ kind: "box", colour, points: part.slice(3, 6), size: part.slice(0, 3), matrix: part.slice(6) });
    }
    return { pose: Array.from(pose), shapes };
  }

  // --- flat scenes -------------------------------------------------------------------------------------------------

  function fitted(box, view) {
    const scale = Math.min(box.width / (view.x[1] - view.x[0]), box.height / (view.y[1] - view.y[0]));
    const left = box.x + 0.5 * (box.width - scale * (view.x[1] - view.x[0]));
    const bottom = box.y + box.height - 0.5 * (box.height - scale * (view.y[1] - view.y[0]));
    return { scale, left, bottom };
  }

  function flat(context, box, view, items) {
    const { scale, left, bottom } = fitted(box, view);
    context.save();
    context.beginPath();
    context.rect(box.x, box.y, box.width, box.height);
    context.clip();
    context.lineCap = context.lineJoin = "round";
    for (const { pose, shapes } of items) {
      const [x, y, angle] = pose.length ? pose : [0, 0, 0];
      const [cosine, sine] = [Math.cos(angle), Math.sin(angle)];
      const at = (u, v) => [
        left + scale * (x + cosine * u - sine * v - view.x[0]),
        bottom - scale * (y + sine * u + cosine * v - view.y[0]),
      ];
      for (const shape of shapes) flatShape(context, shape, at, scale);
    }
    context.restore();
  }

  function flatShape(context, { kind, colour, points, size }, at, scale) {
    context.fillStyle = context.strokeStyle = colour;
    context.beginPath();
    if (kind === "disc" || kind === "ring") {
      context.arc(...at(points[0], points[1]), scale * size[0], 0, 2 * Math.PI);
      context.lineWidth = 3;
      if (kind === "disc") context.fill();
      else context.stroke();
      return;
    }
    for (let i = 0; i < points.length; i += 2) context.lineTo(...at(points[i], points[i + 1]));
    if (kind === "polygon") context.fill();
    else {
      context.lineWidth = Math.max(2, 2 * scale * size[0]);
      context.stroke();
    }
  }

  // --- scenes in space ---------------------------------------------------------------------------------------------

  const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
  const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => a.map((value) => value / Math.hypot(...a));
  const times = (m, v) => [0, 3, 6].map((row) => m[row] * v[0] + m[row + 1] * v[1] + m[row + 2] * v[2]);
  const identity = [1, 0, 0, 0, 1, 0, 0, 0, 1];

  function matrixOf([x, y, z, w]) {
    return [
      1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
      2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
      2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y),
    ];
  }

  const corners = [-1, 1].flatMap((x) => [-1, 1].flatMap((y) => [-1, 1].map((z) => [x, y, z])));
  const faces = [
    [[0, 1, 3, 2], [-1, 0, 0]], [[4, 6, 7, 5], [1, 0, 0]], [[0, 4, 5, 1], [0, -1, 0]],
    [[2, 3, 7, 6], [0, 1, 0]], [[0, 2, 6, 4], [0, 0, -1]], [[1, 5, 7, 3], [0, 0, 1]],
  ];
  const light = unit([0.35, -0.5, 0.8]);

  class Raster {
    constructor(width, height, view) {
      this.width = width;
      this.height = height;
      this.depth = new Float32Array(width * height);
      this.image = new ImageData(width, height);
      this.pixels = new Uint32Array(this.image.data.buffer);
      this.back = unit(minus(view.eye, view.target));
      this.right = unit(cross(view.up, this.back));
      this.upward = cross(this.back, this.right);
      this.eye = view.eye;
      this.near = view.near;
      this.focus = (0.5 * height) / Math.tan((0.5 * view.field * Math.PI) / 180);
    }

    // Camera coordinates: right, up and the distance ahead.
    seen(point) {
      const from = minus(point, this.eye);
      return [dot(from, this.right), dot(from, this.upward), -dot(from, this.back)];
    }

    onScreen([x, y, ahead]) {
      return [0.5 * this.width + (this.focus * x) / ahead, 0.5 * this.height - (this.focus * y) / ahead, 1 / ahead];
    }

    polygon(points, colour) {
      const seen = points.map((point) => this.seen(point));
      const kept = [];
      seen.forEach((point, i) => {
        const next = seen[(i + 1) % seen.length];
        if (point[2] >= this.near) kept.push(point);
        if (point[2] >= this.near !== next[2] >= this.near) {
          const share = (this.near - point[2]) / (next[2] - point[2]);
          kept.push(point.map((value, axis) => value + share * (next[axis] - value)));
        }
      });
      const flatPoints = kept.map((point) => this.onScreen(point));
      for (let i = 2; i < flatPoints.length; i++) this.triangle(flatPoints[0], flatPoints[i - 1], flatPoints[i], colour);
    }

    triangle(a, b, c, colour) {
      const area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
      if (Math.abs(area) < 1e-9) return;
      const [top, bottom] = [Math.min(a[1], b[1], c[1]), Math.max(a[1], b[1], c[1])];
      const first = Math.max(0, Math.ceil(top - 0.5));
      const last = Math.min(this.height - 1, Math.floor(bottom - 0.5));
      // The inverse of the distance is linear on the screen.
      const slopeX = ((b[2] - a[2]) * (c[1] - a[1]) - (c[2] - a[2]) * (b[1] - a[1])) / area;
      const slopeY = ((c[2] - a[2]) * (b[0] - a[0]) - (b[2] - a[2]) * (c[0] - a[0])) / area;
      for (let row = first; row <= last; row++) {
        const y = row + 0.5;
        let left = Infinity;
        let right = -Infinity;
        for (const [p, q] of [[a, b], [b, c], [c, a]]) {
          if (y < Math.min(p[1], q[1]) || y > Math.max(p[1], q[1]) || p[1] === q[1]) continue;
          const x = p[0] + ((y - p[1]) / (q[1] - p[1])) * (q[0] - p[0]);
          left = Math.min(left, x);
          right = Math.max(right, x);
        }
        const from = Math.max(0, Math.ceil(left - 0.5));
        const to = Math.min(this.width - 1, Math.floor(right - 0.5));
        let nearness = a[2] + slopeX * (from + 0.5 - a[0]) + slopeY * (y - a[1]);
        for (let column = from; column <= to; column++, nearness += slopeX) {
          const index = row * this.width + column;
          if (nearness > this.depth[index]) {
            this.depth[index] = nearness;
            this.pixels[index] = colour;
          }
        }
      }
    }

    ball(centre, radius, colour) {
      const seen = this.seen(centre);
      if (seen[2] < this.near) return;
      const [x, y] = this.onScreen(seen);
      const reach = (this.focus * radius) / seen[2];
      for (let row = Math.max(0, Math.ceil(y - reach)); row <= Math.min(this.height - 1, y + reach); row++)
        for (let column = Math.max(0, Math.ceil(x - reach)); column <= Math.min(this.width - 1, x + reach); column++) {
          const [u, v] = [(column - x) / reach, (y - row) / reach];
          const square = 1 - u * u - v * v;
          if (square < 0) continue;
          const out = Math.sqrt(square);
          const nearness = 1 / (seen[2] - radius * out);
          const index = row * this.width + column;
          if (nearness <= this.depth[index]) continue;
          this.depth[index] = nearness;
          const normal = [0, 1, 2].map((i) => u * this.right[i] + v * this.upward[i] + out * this.back[i]);
          this.pixels[index] = shaded(colour, normal);
        }
    }
  }

  function shaded(colour, normal) {
    const bright = 0.62 + 0.38 * Math.max(0, dot(normal, light));
    const [red, green, blue] = [1, 3, 5].map((i) => Math.round(bright * parseInt(colour.slice(i, i + 2), 16)));
    return ((255 << 24) | (blue << 16) | (green << 8) | red) >>> 0;
  }

  function space(context, box, view, items) {
    const fits = Math.min(box.width, box.height * view.aspect);
    const [width, height] = [Math.round(fits), Math.round(fits / view.aspect)];
    const raster = new Raster(width, height, view);
    const marks = [];
    for (const { pose, shapes } of items) {
      const turn = pose.length === 7 ? matrixOf(pose.slice(3)) : identity;
      const place = pose.length ? Array.from(pose.slice(0, 3)) : [0, 0, 0];
      const at = (point) => add(place, times(turn, point));
      for (const shape of shapes) {
        if (shape.kind === "box") box3(raster, shape, turn, at);
        else if (shape.kind === "patch") raster.polygon(shape.points.map(at), shaded(shape.colour, [0, 0, 1]));
        else if (shape.kind === "ball") raster.ball(at(shape.points), shape.size[0], shape.colour);
        else marks.push({ ...shape, at });
      }
    }
    const canvas = new OffscreenCanvas(width, height);
    canvas.getContext("2d").putImageData(raster.image, 0, 0);
    const [left, top] = [box.x + 0.5 * (box.width - width), box.y + 0.5 * (box.height - height)];
    context.drawImage(canvas, left, top);
    context.save();
    context.beginPath();
    context.rect(left, top, width, height);
    context.clip();
    for (const mark of marks) {
      context.fillStyle = context.strokeStyle = mark.colour;
      context.lineWidth = (mark.size[0] * width) / 480;
      context.beginPath();
      for (let i = 0; i < mark.points.length; i += 3) {
        const [x, y] = raster.onScreen(raster.seen(mark.at(mark.points.slice(i, i + 3))));
        if (mark.kind === "dot") context.arc(left + x, top + y, (mark.size[0] * width) / 480, 0, 2 * Math.PI);
        else context.lineTo(left + x, top + y);
      }
      if (mark.kind === "dot") context.fill();
      else context.stroke();
    }
    context.restore();
  }

  function box3(raster, shape, turn, at) {
    const own = shape.matrix || (shape.rotation && shape.rotation.length ? matrixOf(shape.rotation) : identity);
    const points = corners.map((corner) => at(add(shape.points, times(own, corner.map((s, i) => s * shape.size[i])))));
    for (const [order, normal] of faces) {
      const outward = times(turn, times(own, normal));
      if (dot(outward, minus(points[order[0]], raster.eye)) >= 0) continue;
      raster.polygon(order.map((index) => points[index]), shaded(shape.colour, outward));
    }
  }

  function scene(context, box, view, items) {
    if (view.eye) space(context, box, view, items);
    else flat(context, box, view, items);
  }

  // Where a pixel of a scene is: in its plane, or at a height in space.
  function placeAt(box, view, [column, row], height) {
    if (!view.eye) {
      const { scale, left, bottom } = fitted(box, view);
      return [view.x[0] + (column - left) / scale, view.y[0] + (bottom - row) / scale];
    }
    const width = Math.min(box.width, box.height * view.aspect);
    const [across, down] = [column - box.x - 0.5 * box.width, row - box.y - 0.5 * box.height];
    const raster = new Raster(1, 1, view);
    const focus = (0.5 * width) / view.aspect / Math.tan((0.5 * view.field * Math.PI) / 180);
    const ray = [0, 1, 2].map((i) => (across * raster.right[i] - down * raster.upward[i]) / focus - raster.back[i]);
    const share = (height - view.eye[2]) / ray[2];
    return [view.eye[0] + share * ray[0], view.eye[1] + share * ray[1]];
  }

  // A rectangle on the ground, as an item.
  function field(view, [left, right], [front, back], height, colour) {
    const ground = [[left, front], [right, front], [right, back], [left, back]];
    const shape = view.eye
      ? { kind: "patch", colour, points: ground.map((point) => [...point, height]) }
      : { kind: "polygon", colour, points: ground.flat() };
    return { pose: [], shapes: [shape] };
  }

  // The tool alone, its middle at `centre`.
  function tool(context, kind, values, centre, extent, scale, colour) {
    const [u, v] = extent.plane;
    const corner = (shape) => corners.map((signs) => add(shape.points, times(shape.matrix, signs.map((s, i) => s * shape.size[i]))));
    const shapes = toolItem(kind, values, [], colour).shapes;
    const all = shapes.flatMap((shape) =>
      kind === "planar" ? [[...shape.points.slice(0, 2), 0], [...shape.points.slice(2), 0]] : corner(shape));
    const middle = [0, 1, 2].map((i) => 0.5 * (Math.min(...all.map((p) => p[i])) + Math.max(...all.map((p) => p[i]))));
    const place = (point) => [centre[0] + scale * (point[u] - middle[u]), centre[1] - scale * (point[v] - middle[v])];
    context.save();
    context.lineCap = context.lineJoin = "round";
    context.fillStyle = context.strokeStyle = colour;
    if (kind === "planar") {
      // One path, so that links do not shine through each other.
      context.beginPath();
      for (const { points } of shapes) {
        context.moveTo(...place([points[0], points[1], 0]));
        context.lineTo(...place([points[2], points[3], 0]));
      }
      context.lineWidth = Math.max(2, 2 * scale * shapes[0].size[0]);
      context.stroke();
    }
    for (const shape of kind === "planar" ? [] : shapes) {
      const points = corner(shape);
      for (const [order] of faces) {
        context.beginPath();
        order.forEach((index) => context.lineTo(...place(points[index])));
        context.closePath();
        context.fill();
        context.lineWidth = 1;
        context.stroke();
      }
    }
    context.restore();
  }

  return { itemsOfFrame, itemsOfStart, toolItem, scene, placeAt, field, tool };
})();
