// From metres to pixels: pan, zoom, fit, follow.
(function (NLOSIM) {
  "use strict";

  const LEAST = 0.02; // [pixel/m]
  const MOST = 120;

  const SPARE = 0.25; // of the size of the picture, beyond each of its sides

  NLOSIM.Camera = class Camera {
    constructor() {
      this.x = 0; // the middle of the picture [m]
      this.y = 0;
      this.scale = 4;
      this.width = 1;
      this.height = 1;
      this.version = 0;
    }

    resize(width, height) {
      Object.assign(this, { width, height });
      this.version += 1;
    }

    toScreen(x, y) {
      return [(x - this.x) * this.scale + this.width / 2, (this.y - y) * this.scale + this.height / 2];
    }

    toWorld(left, top) {
      return [(left - this.width / 2) / this.scale + this.x, this.y - (top - this.height / 2) / this.scale];
    }

    move(left, top) {
      this.x -= left / this.scale;
      this.y += top / this.scale;
      this.version += 1;
    }

    center(x, y) {
      if (x === this.x && y === this.y) return;
      Object.assign(this, { x, y });
      this.version += 1;
    }

    // The middle and the scale of another camera.
    show({ x, y, scale }) {
      Object.assign(this, { x, y, scale });
      this.version += 1;
    }

    // What is at a place of the picture stays there.
    zoom(factor, left = this.width / 2, top = this.height / 2) {
      const [x, y] = this.toWorld(left, top);
      this.scale = Math.max(LEAST, Math.min(MOST, this.scale * factor));
      this.x = x - (left - this.width / 2) / this.scale;
      this.y = y + (top - this.height / 2) / this.scale;
      this.version += 1;
    }

    fit([west, south, east, north], margin = 0.04) {
      const [width, height] = [Math.max(10, east - west), Math.max(10, north - south)];
      this.scale = Math.max(LEAST, Math.min(MOST, (1 - 2 * margin) * Math.min(this.width / width, this.height / height)));
      this.center((west + east) / 2, (south + north) / 2);
      this.version += 1;
    }

    // Sets the canvas so that drawing is in metres.
    apply(context) {
      const ratio = this.ratio || 1;
      const scale = this.scale * ratio;
      context.setTransform(scale, 0, 0, -scale, (this.width / 2 - this.x * this.scale) * ratio, (this.height / 2 + this.y * this.scale) * ratio);
    }

    // Sets the canvas so that drawing is in metres from a place, along a heading.
    applyAt(context, x, y, heading) {
      const scale = this.scale * (this.ratio || 1);
      const [cosine, sine] = [Math.cos(heading) * scale, Math.sin(heading) * scale];
      const [left, top] = this.toScreen(x, y);
      context.setTransform(cosine, -sine, -sine, -cosine, left * (this.ratio || 1), top * (this.ratio || 1));
    }

    // A camera that sees a little more on each side.
    spare() {
      const wider = Object.assign(new NLOSIM.Camera(), this);
      wider.width = this.width * (1 + 2 * SPARE);
      wider.height = this.height * (1 + 2 * SPARE);
      return wider;
    }

    // How far the picture has moved since another camera of the same size; null if that no longer
    // sees all of it.
    since(wider) {
      if (!wider || wider.scale !== this.scale || wider.width !== this.width * (1 + 2 * SPARE) ||
        wider.height !== this.height * (1 + 2 * SPARE) || wider.ratio !== this.ratio) return null;
      const [left, top] = [(wider.x - this.x) * this.scale, (this.y - wider.y) * this.scale];
      if (Math.abs(left) > SPARE * this.width || Math.abs(top) > SPARE * this.height) return null;
      return [left - SPARE * this.width, top - SPARE * this.height];
    }

    plain(context) {
      context.setTransform(this.ratio || 1, 0, 0, this.ratio || 1, 0, 0);
    }
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
