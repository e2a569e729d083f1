// The bar at the bottom: play, slider, time, speed; and the keys that do the same.
(function (NLOSIM) {
  "use strict";

  const { el } = NLOSIM;

  // What keys do with the time of the page.
  NLOSIM.timeKeys = function timeKeys(page) {
    const { clock } = page;
    const step = () => Math.max(clock.span / 2000, Math.min(0.1, clock.span / 100));
    page.key([" "], "play and pause", () => clock.play());
    page.key(["ArrowLeft", "ArrowRight"], "a little back and forth; with shift, ten times as much", (event) => {
      clock.play(false);
      clock.seek(clock.time + (event.key === "ArrowLeft" ? -1 : 1) * step() * (event.shiftKey ? 10 : 1));
    });
    page.key(["Home", "End"], "to the start, to the end", (event) => clock.seek(event.key === "Home" ? 0 : clock.span));
    page.key([",", "."], "slower, faster", (event) => clock.faster(event.key === "," ? -1 : 1));
  };

  NLOSIM.player = function player(bar, page) {
    const { clock } = page;
    const button = el("button", { class: "play", type: "button", onclick: () => clock.play() });
    const slider = el("input", {
      type: "range", min: 0, max: 100000, step: 1, value: 0, "aria-label": "time",
      oninput: () => clock.seek((slider.value / 100000) * clock.span),
    });
    const time = el("output", { class: "time" });
    const speed = el("select", {
      "aria-label": "speed", title: "simulated seconds per second (, and .)",
      onchange: () => { clock.speed = Number(speed.value); clock.changed(); },
    }, NLOSIM.SPEEDS.map((value) => el("option", { value }, `× ${value}`)), el("option", { value: "own", hidden: true }, "× …"));
    const help = el("button", {
      type: "button", class: "quiet", title: "keys (?)", "aria-label": "help", onclick: () => page.help(),
    }, "?");
    bar.append(button, slider, time, speed, help);
    bar.hidden = false;
    const digits = clock.span < 0.1 ? 6 : clock.span < 10 ? 3 : 2;
    clock.listen((now, playing) => {
      button.textContent = playing ? "❚❚" : "▶";
      button.setAttribute("aria-label", playing ? "pause" : "play");
      slider.value = Math.round((now / (clock.span || 1)) * 100000);
      slider.setAttribute("aria-valuetext", `${now.toFixed(digits)} seconds`);
      time.textContent = `${(page.start + now).toFixed(digits)} s`;
      speed.value = NLOSIM.SPEEDS.includes(clock.speed) ? String(clock.speed) : "own";
    });
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
