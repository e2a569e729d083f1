// The time that all parts of the page show, and whether it goes on.
(function (NLOSIM) {
  "use strict";

  NLOSIM.SPEEDS = [0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10, 30];

  NLOSIM.Clock = class Clock {
    // `span` of the run [s]; `frame` calls back before the next picture, with the time [ms]
    constructor(span, frame) {
      this.span = span;
      this.time = 0;
      this.speed = 1;
      this.playing = false;
      this.frame = frame;
      this.listeners = [];
      this.before = null;
      this.asked = false;
    }

    listen(listener) {
      this.listeners.push(listener);
    }

    // All listeners are told before the next picture, once.
    changed() {
      if (this.asked) return;
      this.asked = true;
      this.frame((now) => this.tick(now));
    }

    tick(now) {
      this.asked = false;
      if (this.playing && this.before !== null) {
        this.time = Math.min(this.span, this.time + ((now - this.before) / 1000) * this.speed);
        if (this.time >= this.span) this.playing = false;
      }
      this.before = this.playing ? now : null;
      for (const listener of this.listeners) listener(this.time, this.playing);
      if (this.playing) this.changed();
    }

    seek(time) {
      if (!Number.isFinite(time)) return;
      this.time = Math.max(0, Math.min(this.span, time));
      this.changed();
    }

    play(playing = !this.playing) {
      if (playing && this.time >= this.span) this.time = 0;
      this.playing = playing;
      this.before = null;
      this.changed();
    }

    faster(by) {
      const { SPEEDS } = NLOSIM;
      const now = SPEEDS.reduce((best, speed, k) =>
        (Math.abs(speed - this.speed) < Math.abs(SPEEDS[best] - this.speed) ? k : best), 0);
      this.speed = SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, now + by))];
      this.changed();
    }
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
