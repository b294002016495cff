// What part of the map is seen: its middle in tenths of a metre, and pixels per tenth.

const CLOSEST = 4, FARTHEST = 0.004;

class View {
  constructor(box) {
    this.box = box;
    this.x = (box[0] + box[1]) / 2;
    this.y = (box[2] + box[3]) / 2;
    this.scale = 0; // not yet fitted
    this.followed = null; // {run, vehicle}
    this.fitted = true;
  }

  fit(width, height) {
    const [west, east, south, north] = this.box;
    this.scale = 0.94 * Math.min(width / Math.max(1, east - west), height / Math.max(1, north - south));
    this.x = (west + east) / 2;
    this.y = (south + north) / 2;
    this.followed = null;
    this.fitted = true;
  }

  left(x, width) { return width / 2 + (x - this.x) * this.scale; }

  top(y, height) { return height / 2 - (y - this.y) * this.scale; }

  pan(right, down) {
    if (!this.scale) return;
    this.x -= right / this.scale;
    this.y += down / this.scale;
    this.followed = null;
    this.fitted = false;
  }

  // What is under a point of the canvas stays there; the one followed stays in the middle.
  zoom(factor, left, top, width, height) {
    if (!this.scale) return;
    const x = this.x + (left - width / 2) / this.scale, y = this.y - (top - height / 2) / this.scale;
    const before = this.scale;
    this.scale = Math.min(CLOSEST, Math.max(FARTHEST, this.scale * factor));
    this.fitted = false;
    if (this.followed) return;
    this.x = x - (x - this.x) * (before / this.scale);
    this.y = y - (y - this.y) * (before / this.scale);
  }

  // Metres as a matrix of the canvas, so that lines are drawn as they are stored.
  onto(context, ratio, width, height) {
    const k = this.scale * ratio;
    context.setTransform(k, 0, 0, -k, ratio * width / 2 - this.x * k, ratio * height / 2 + this.y * k);
  }
}
