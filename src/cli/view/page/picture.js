// Pictures: half floats as they come, tone curves as tables over all 65536 half floats, and the canvas that shows them.

/** The value of every half float. */
export const VALUE = (() => {
  const table = new Float32Array(65536);
  for (let bits = 0; bits < 65536; bits++) {
    const exponent = (bits >> 10) & 31, fraction = bits & 1023, sign = bits & 32768 ? -1 : 1;
    table[bits] = exponent === 31 ? (fraction ? NaN : sign * Infinity)
      : exponent ? sign * (1 + fraction / 1024) * 2 ** (exponent - 15) : sign * fraction * 2 ** -24;
  }
  return table;
})();

/** The sRGB curve, 0 to 255. */
const curve = x => 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
/** A curve that keeps what is brighter than white apart (Narkowicz, "ACES filmic tone mapping curve", 2015). */
const filmic = x => x > 1e4 ? 1 : Math.min(1, x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14));

/** The colours of false colour and error maps: from dark blue over green and yellow to white. */
const RAMP = (() => {
  const stops = [[0, 0, 20], [48, 18, 59], [70, 98, 215], [54, 170, 249], [26, 228, 182], [114, 254, 94], [200, 239, 52], [250, 186, 57], [246, 107, 25], [203, 42, 4], [255, 255, 255]];
  const table = new Uint8Array(256 * 3);
  for (let i = 0; i < 256; i++) {
    const at = i / 255 * (stops.length - 1), k = Math.min(Math.floor(at), stops.length - 2);
    for (let c = 0; c < 3; c++) table[3 * i + c] = stops[k][c] + (at - k) * (stops[k + 1][c] - stops[k][c]);
  }
  return table;
})();
const paint = (out, at, share) => {
  const i = 3 * Math.max(0, Math.min(255, Math.round(255 * share)));
  out[at] = RAMP[i]; out[at + 1] = RAMP[i + 1]; out[at + 2] = RAMP[i + 2];
};

/** A bar of the colours, with what they mean. */
function legend(context, ratio, height, title, ticks) {
  const width = 260 * ratio, x = 14 * ratio, y = height - 34 * ratio;
  context.save();
  context.fillStyle = "rgb(0 0 0 / .62)";
  context.fillRect(x - 8 * ratio, y - 22 * ratio, width + 24 * ratio, 50 * ratio);
  for (let i = 0; i < width; i++) {
    const c = 3 * Math.floor(255 * i / width);
    context.fillStyle = `rgb(${RAMP[c]} ${RAMP[c + 1]} ${RAMP[c + 2]})`;
    context.fillRect(x + i, y, 1, 9 * ratio);
  }
  context.fillStyle = "#fff"; context.font = `${12 * ratio}px system-ui, sans-serif`; context.textBaseline = "alphabetic";
  context.fillText(title, x, y - 7 * ratio);
  for (const [share, text] of ticks) {
    context.textAlign = share === 0 ? "left" : share === 1 ? "right" : "center";
    context.fillText(text, x + share * width, y + 22 * ratio);
  }
  context.restore();
}

/** One picture: its half floats, and a canvas of them behind a tone curve. */
export class Layer {
  constructor(id) {
    this.id = id;
    this.width = this.height = 0;
    this.canvas = document.createElement("canvas");
    this.context = this.canvas.getContext("2d");
    this.stale = true;
  }
  /** Takes a message of the server; src/cli/view/frame.rs says what is in it. */
  take(buffer) {
    const head = new Uint32Array(buffer, 0, 5), [, epoch, width, height, count] = head;
    if (this.width !== width || this.height !== height || this.epoch !== epoch) {
      if (this.width !== width || this.height !== height) {
        this.canvas.width = width; this.canvas.height = height;
        this.image = this.context.createImageData(width, height);
        this.image.data.fill(255);
        this.halves = new Uint16Array(3 * width * height);
      }
      Object.assign(this, { width, height, epoch });
    }
    const table = new Uint16Array(buffer, 20, 4 * count);
    let values = new Uint16Array(buffer, 20 + 8 * count), at = 0;
    for (let tile = 0; tile < count; tile++) {
      const [x, y, w, h] = table.subarray(4 * tile, 4 * tile + 4);
      for (let row = y; row < y + h; row++, at += 3 * w) this.halves.set(values.subarray(at, at + 3 * w), 3 * (row * width + x));
    }
    if (count) this.stale = true;
  }
  /** The radiance of a pixel. */
  at(x, y) {
    const at = 3 * (y * this.width + x);
    return [VALUE[this.halves[at]], VALUE[this.halves[at + 1]], VALUE[this.halves[at + 2]]];
  }
  /** Draws the half floats into the canvas. */
  draw(tone, reference) {
    if (!this.stale && this.drawn === tone.version && !reference) return;
    const { halves, image } = this, out = image.data, pixels = this.width * this.height;
    if (reference && reference.halves && reference.width === this.width && reference.height === this.height) {
      const truth = reference.halves;
      for (let p = 0, i = 0; p < pixels; p++, i += 3) {
        let sum = 0;
        for (let c = i; c < i + 3; c++) {
          const r = VALUE[truth[c]], d = VALUE[halves[c]] - r;
          sum += d * d / (r * r + 1e-4);
        }
        // Six decades: a relative squared error from a millionth (a tenth of a percent) to 1.
        paint(out, 4 * p, (Math.log10(sum / 3 + 1e-12) + 6) / 6);
      }
    } else if (tone.mode === "false") {
      const gain = tone.gain;
      for (let p = 0, i = 0; p < pixels; p++, i += 3) {
        const y = 0.2126 * VALUE[halves[i]] + 0.7152 * VALUE[halves[i + 1]] + 0.0722 * VALUE[halves[i + 2]];
        // Twelve stops, 1 at three quarters of them.
        paint(out, 4 * p, y > 0 ? (Math.log2(y * gain) + 9) / 12 : 0);
      }
    } else {
      const bytes = tone.bytes;
      for (let p = 0, i = 0; p < pixels; p++, i += 3) {
        out[4 * p] = bytes[halves[i]]; out[4 * p + 1] = bytes[halves[i + 1]]; out[4 * p + 2] = bytes[halves[i + 2]];
      }
    }
    this.context.putImageData(image, 0, 0);
    this.stale = false;
    this.drawn = reference ? -1 : tone.version;
  }
}

/** How radiances become colours. */
export class Tone {
  constructor() { this.mode = "srgb"; this.stops = 0; this.version = 0; this.bytes = new Uint8ClampedArray(65536); this.set({}); }
  set(change) {
    Object.assign(this, change);
    this.gain = 2 ** this.stops;
    const shape = this.mode === "white" ? x => curve(filmic(x)) : x => curve(Math.min(x, 1));
    for (let bits = 0; bits < 65536; bits++) {
      const x = VALUE[bits] * this.gain;
      this.bytes[bits] = x > 0 ? Math.round(shape(x)) : 0;
    }
    this.version++;
  }
}

/** The canvas that shows layers: each in a cell of its own, all with the same zoom; or one over the other with dividers. */
export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.film = { width: 1, height: 1 };
    this.fit();
    this.dividers = [];
    this.split = false;
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }
  resize() {
    const ratio = devicePixelRatio || 1, box = this.canvas.getBoundingClientRect();
    this.ratio = ratio;
    this.canvas.width = Math.max(1, Math.round(box.width * ratio));
    this.canvas.height = Math.max(1, Math.round(box.height * ratio));
    this.changed?.();
  }
  fit() { this.zoom = 1; this.middle = [0.5, 0.5]; }
  /** The rectangles of so many pictures, in device pixels. */
  cells(count) {
    const { width, height } = this.canvas;
    if (this.split || count <= 1) return Array.from({ length: Math.max(count, 1) }, () => ({ x: 0, y: 0, w: width, h: height }));
    // The number of columns that leaves the pictures largest.
    let best = null;
    for (let columns = 1; columns <= count; columns++) {
      const rows = Math.ceil(count / columns), w = width / columns, h = height / rows;
      const size = Math.min(w / this.film.width, h / this.film.height);
      if (!best || size > best.size + 1e-9) best = { size, columns, w, h };
    }
    return Array.from({ length: count }, (_, i) => ({
      x: Math.round((i % best.columns) * best.w), y: Math.round(Math.floor(i / best.columns) * best.h),
      w: Math.floor(best.w) - (i % best.columns < best.columns - 1 ? 2 : 0), h: Math.floor(best.h) - 2,
    }));
  }
  /** Device pixels to a pixel of the film, in a cell. */
  scale(cell) { return this.zoom * Math.min(cell.w / this.film.width, cell.h / this.film.height); }
  /** Where the film lies in a cell. */
  place(cell) {
    const scale = this.scale(cell), w = this.film.width * scale, h = this.film.height * scale;
    return { x: cell.x + cell.w / 2 - this.middle[0] * w, y: cell.y + cell.h / 2 - this.middle[1] * h, w, h, scale };
  }
  /** The pixel of the film under a point of the page, with its cell. */
  pixel(clientX, clientY, count) {
    const box = this.canvas.getBoundingClientRect();
    const x = (clientX - box.left) * this.ratio, y = (clientY - box.top) * this.ratio, cells = this.cells(count);
    let index = cells.findIndex(c => x >= c.x && x < c.x + c.w && y >= c.y && y < c.y + c.h);
    if (index < 0) index = 0;
    if (this.split) index = this.dividers.filter(d => d * this.canvas.width <= x).length;
    const place = this.place(cells[Math.min(index, cells.length - 1)]);
    const px = Math.floor((x - place.x) / place.scale), py = Math.floor((y - place.y) / place.scale);
    const inside = px >= 0 && py >= 0 && px < this.film.width && py < this.film.height;
    return { x: px, y: py, index, inside };
  }
  /** Zooms about a point of the page. */
  zoomAt(factor, clientX, clientY, count) {
    const cells = this.cells(count), box = this.canvas.getBoundingClientRect();
    const x = (clientX - box.left) * this.ratio, y = (clientY - box.top) * this.ratio;
    const cell = cells.find(c => x >= c.x && x < c.x + c.w && y >= c.y && y < c.y + c.h) || cells[0];
    const before = this.place(cell), u = (x - before.x) / before.w, v = (y - before.y) / before.h;
    this.zoom = Math.min(Math.max(this.zoom * factor, 1), 64 * Math.max(1, this.film.width / cell.w));
    const after = this.place(cell);
    this.middle = [this.middle[0] + u - (x - after.x) / after.w, this.middle[1] + v - (y - after.y) / after.h];
    this.hold();
  }
  move(dx, dy, count) {
    const place = this.place(this.cells(count)[0]);
    this.middle = [this.middle[0] - dx * this.ratio / place.w, this.middle[1] - dy * this.ratio / place.h];
    this.hold();
  }
  /** Keeps the picture in sight. */
  hold() {
    const margin = 0.5 / this.zoom;
    this.middle = this.middle.map(m => this.zoom <= 1 ? 0.5 : Math.min(Math.max(m, margin), 1 - margin));
  }
  /** A frame around a pixel of the film, in every cell. */
  mark(x, y, count) {
    const { context } = this;
    for (const cell of this.cells(count)) {
      const { x: left, y: top, scale } = this.place(cell), side = Math.max(scale, 9 * this.ratio);
      const at = [left + (x + 0.5) * scale - side / 2, top + (y + 0.5) * scale - side / 2, side, side];
      context.save();
      context.beginPath(); context.rect(cell.x, cell.y, cell.w, cell.h); context.clip();
      for (const [colour, width] of [["#000", 4], ["#fff", 2]]) {
        context.strokeStyle = colour; context.lineWidth = width * this.ratio; context.strokeRect(...at);
      }
      context.restore();
    }
  }
  draw(layers, tone, reference) {
    const { context, canvas } = this;
    context.clearRect(0, 0, canvas.width, canvas.height);
    const cells = this.cells(layers.length);
    layers.forEach((layer, i) => {
      if (!layer.width) return;
      layer.draw(tone, reference);
      const cell = cells[i], place = this.place(cell);
      context.save();
      context.beginPath();
      if (this.split) {
        const from = i ? this.dividers[i - 1] : 0, to = this.dividers[i] ?? 1;
        context.rect(from * canvas.width, 0, (to - from) * canvas.width, canvas.height);
      } else context.rect(cell.x, cell.y, cell.w, cell.h);
      context.clip();
      context.imageSmoothingEnabled = place.scale < 1;
      context.imageSmoothingQuality = "high";
      context.drawImage(layer.canvas, place.x, place.y, place.w, place.h);
      context.restore();
    });
    const short = x => String(+x.toPrecision(2)).replace(/^0\./, ".");
    if (reference) legend(context, this.ratio, canvas.height, "squared error over squared reference", [0, 1, 2, 3].map(k => [k / 3, `1e${2 * k - 6}`]));
    else if (tone.mode === "false") legend(context, this.ratio, canvas.height, "luminance", [0, 1, 2, 3, 4].map(k => [k / 4, short(2 ** (3 * k - 9) / tone.gain)]));
    if (this.split) for (const d of this.dividers.slice(0, layers.length - 1)) {
      const x = Math.round(d * canvas.width), y = canvas.height / 2, r = 11 * this.ratio;
      context.fillStyle = "#fff";
      context.fillRect(x - this.ratio, 0, 2 * this.ratio, canvas.height);
      context.beginPath(); context.arc(x, y, r, 0, 7); context.fill();
      context.fillStyle = "#222"; context.font = `${12 * this.ratio}px sans-serif`; context.textAlign = "center"; context.textBaseline = "middle";
      context.fillText("◂▸", x, y);
    }
  }
}
