// The top view: canvas, choices, cards.
(function (NLOSIM) {
  "use strict";

  const { el, colours } = NLOSIM;
  const SLOWLY = 200; // cards are made anew so often while time goes on [ms]

  class View {
    constructor(page, data) {
      const { arrays } = page;
      Object.assign(this, { page, data, selected: -1, hovered: -1, followed: -1, packet: -1, flying: [], opened: null });
      this.crowd = new NLOSIM.Crowd(data.crowd, data.entities, arrays);
      this.ground = new NLOSIM.Ground(data.ground, arrays);
      this.radio = data.radio ? new NLOSIM.Radio(data.radio, arrays) : null;
      this.sensing = new NLOSIM.Sensing(data.sensing, arrays);
      this.objects = this.sensing.objects;
      this.relays = data.relays.map((each) => ({ name: each.name, times: arrays.times(each.times), vehicle: arrays.array(each.vehicle) }));
      this.camera = new NLOSIM.Camera();
      this.observer = this.radio && this.radio.full.length ? this.radio.full[0] : data.egos.length ? data.egos[0] : -1;
      this.choices = new Map();
    }

    shows(what) {
      return this.choices.get(what) === true;
    }

    relaysAt(time) {
      return this.relays.filter((each) => this.belongs(each, this.observer)).map((each) => {
        const k = NLOSIM.lastAt(each.times, time + 1e-9);
        return k < 0 ? -1 : each.vehicle[k];
      }).filter((vehicle) => vehicle >= 0);
    }

    // Whether a signal is of a vehicle: it is, unless it has the name of another ego in its own.
    belongs({ name }, vehicle) {
      const words = name.split(/[.\-_]/);
      const named = this.data.egos.filter((ego) => words.includes(this.crowd.labels[ego]));
      return !named.length || named.includes(vehicle);
    }

    bounds() {
      const bounds = [...this.ground.bounds];
      if (bounds[0] < bounds[2]) return bounds;
      const { x, y } = this.crowd;
      for (let k = 0; k < x.length; k += 1) {
        bounds[0] = Math.min(bounds[0], x[k]);
        bounds[1] = Math.min(bounds[1], y[k]);
        bounds[2] = Math.max(bounds[2], x[k]);
        bounds[3] = Math.max(bounds[3], y[k]);
      }
      return bounds;
    }
  }

  // What can be shown: its name, how its legend looks, whether it is shown at first.
  function offered(view) {
    const { radio, sensing } = view;
    const box = (colour, dash) => NLOSIM.svg("svg", { width: 16, height: 12, class: "swatch" },
      NLOSIM.svg("rect", { x: 2, y: 2, width: 12, height: 8, fill: "none", stroke: colour, "stroke-width": 1.6, "stroke-dasharray": dash }));
    const square = (fill, stroke) => NLOSIM.svg("svg", { width: 16, height: 14, class: "swatch" }, NLOSIM.svg("rect", { x: 3, y: 2, width: 10, height: 10, fill, stroke }));
    const disc = (fill, stroke) => NLOSIM.svg("svg", { width: 16, height: 14, class: "swatch" }, NLOSIM.svg("circle", { cx: 8, cy: 7, r: 5, fill, stroke }));
    return [
      ["names", "names", null, true],
      radio && ["links", "links", null, true],
      radio && ["messages", "messages", null, true],
      radio && ["bsms", "BSMs", disc("none", colours.grey), false],
      view.objects.length && ["objects", "objects", box("#b0005a", ""), true],
      sensing.zones.length && ["zones", "blind zones", square("#5b3a6a38", "#5b3a6a"), false],
      sensing.matrices.length && ["matrices", "matrix", square("#0072B280", "none"), false],
      sensing.points.length && ["points", "lidar points", disc(colours.vermillion, "none"), false],
    ].filter(Boolean);
  }

  function legend(view) {
    const items = [];
    const bodies = view.data.entities.slice(0, 8).map((name, k) => item(NLOSIM.svg("svg", { width: 18, height: 12, class: "swatch" },
      NLOSIM.svg("rect", { x: 1, y: 2, width: 16, height: 8, rx: 3, fill: NLOSIM.roleColour(k + 1) })), name));
    items.push(...bodies);
    if (view.crowd.hasNoRadio) items.push(item(NLOSIM.svg("svg", { width: 18, height: 12, class: "swatch" }, NLOSIM.svg("rect",
      { x: 1, y: 2, width: 16, height: 8, rx: 3, fill: "#fff", stroke: "#71879c", "stroke-width": 1.6 })), "without radio"));
    if (view.crowd.hasLidar) items.push(item(NLOSIM.svg("svg", { width: 14, height: 12, class: "swatch" },
      NLOSIM.svg("circle", { cx: 7, cy: 6, r: 3.5, fill: "#fff", stroke: "#000", "stroke-width": 1.6 })), "lidar"));
    if (view.radio) {
      NLOSIM.LINK_STYLES.forEach(({ colour, dash }, k) => items.push(item(NLOSIM.swatch(colour, dash), NLOSIM.LINKS[k])));
      items.push(item("✕\u00a0", "frame lost"));
      const kinds = [...new Set(view.radio.packets.kind)].filter((kind) => kind > 0).sort();
      for (const kind of kinds) items.push(item(mark(kind), NLOSIM.KINDS[kind]));
      if (view.relays.length) items.push(item(NLOSIM.svg("svg", { width: 16, height: 14, class: "swatch" },
        NLOSIM.svg("circle", { cx: 8, cy: 7, r: 5.5, fill: "none", stroke: colours.purple, "stroke-width": 2, "stroke-dasharray": "3 2" })), "relay"));
    }
    if (view.objects.some((each) => each.told)) items.push(item(NLOSIM.svg("svg", { width: 16, height: 12, class: "swatch" },
      NLOSIM.svg("rect", { x: 2, y: 2, width: 12, height: 8, fill: "none", stroke: "#7a3f8f", "stroke-width": 1.6, "stroke-dasharray": "4 2" })), "object that others told"));
    return el("ul", { class: "legend" }, items);
  }

  const item = (sign, text) => el("li", {}, sign, text);

  function mark(kind) {
    const colour = NLOSIM.KIND_COLOURS[kind];
    const shape = kind === 2 ? NLOSIM.svg("rect", { x: 3, y: 2, width: 9, height: 9, fill: colour })
      : kind === 3 ? NLOSIM.svg("path", { d: "M7.5,1 L13,11 L2,11 z", fill: colour })
        : NLOSIM.svg("circle", { cx: 7.5, cy: 6.5, r: 5, fill: "none", stroke: colour, "stroke-width": 1.8 });
    return NLOSIM.svg("svg", { width: 15, height: 13, class: "swatch" }, shape);
  }

  function start(page, data) {
    const view = new View(page, data);
    const { clock } = page;
    const { camera, crowd } = view;
    const still = document.createElement("canvas"); // the ground, with some room beyond the picture
    const canvas = el("canvas", { class: "moving", tabindex: 0, role: "img", "aria-label": "top view" });
    const tip = el("div", { class: "tip", hidden: true });
    const card = el("div", { class: "card-of" });
    const small = (text, title, act) => el("button", { type: "button", title, "aria-label": title, onclick: act }, text);
    const tools = el("div", { class: "tools" }, small("+", "zoom in (+)", () => zoom(1.4)), small("−", "zoom out (−)", () => zoom(1 / 1.4)),
      small("⤢", "show all (0)", () => { view.follow(-1); camera.fit(view.bounds()); view.redraw(); }),
      small("◎", "to the listener (f)", () => home()));
    const stage = el("div", { class: "stage" }, canvas, tools, tip);
    const inputs = new Map();
    const chips = offered(view).map(([name, text, sign, on]) => {
      view.choices.set(name, on);
      const input = el("input", { type: "checkbox", checked: on, onchange: () => { view.choices.set(name, input.checked); view.redraw(); } });
      inputs.set(name, input);
      return el("label", { class: "chip" }, input, sign, text);
    });
    const listener = view.radio && view.radio.full.length ? el("select", { "aria-label": "listener", onchange: () => view.observe(Number(listener.value)) },
      view.radio.full.map((k) => el("option", { value: k }, crowd.title(k)))) : null;
    const { whole, body } = NLOSIM.section("Top view", { id: "top-view" });
    body.append(el("div", { class: "view" }, el("div", { class: "left" }, el("div", { class: "bar" }, listener && listener.options.length > 1 ? ["links to", listener] : null, chips), stage, legend(view)),
      el("aside", { class: "right", "aria-live": "off" }, card)));
    const notes = [];
    if (view.radio && view.radio.stride > 1) notes.push(`Of the BSMs, one in ${view.radio.stride} of each vehicle is on this page.`);
    if (data.crowd.stride > 1) notes.push(`Places are those of one communication point in ${data.crowd.stride}, with straight lines between them.`);
    if (notes.length) body.append(el("p", { class: "note" }, notes.join(" ")));
    let drawn = null; // the camera with which the ground was drawn
    let made = 0;

    // Copies the picture of the ground, which is drawn anew where it does not reach.
    function lay(context) {
      let moved = camera.since(drawn);
      if (!moved) {
        drawn = camera.spare();
        still.width = Math.round(drawn.width * camera.ratio);
        still.height = Math.round(drawn.height * camera.ratio);
        view.ground.draw(still.getContext("2d"), drawn);
        moved = camera.since(drawn);
      }
      context.setTransform(1, 0, 0, 1, 0, 0);
      context.drawImage(still, Math.round(moved[0] * camera.ratio), Math.round(moved[1] * camera.ratio));
    }

    function paint(time) {
      if (!whole.open || !camera.ratio) return; // it has no size yet
      if (view.followed >= 0) {
        const now = crowd.at(time);
        const n = now.row[view.followed];
        if (n >= 0) camera.center(now.x[n], now.y[n]);
      }
      const context = canvas.getContext("2d", { alpha: false });
      lay(context);
      view.ground.lights(context, camera, time);
      view.ground.scale(context, camera);
      view.sensing.draw(context, view, time);
      if (view.shows("links")) NLOSIM.links(context, view, time);
      NLOSIM.bodies(context, view, time);
      view.sensing.drawAbove(context, view, time);
      view.flying = [];
      if (view.radio && (view.shows("messages") || view.shows("bsms"))) NLOSIM.flights(context, view, time, view.shows("bsms"));
      if (view.shows("names")) NLOSIM.names(context, view, time);
    }

    function tell(time, playing) {
      const now = performance.now();
      if (playing && now - made < SLOWLY) return;
      made = now;
      if (view.packet >= 0) {
        if (card.dataset.packet !== String(view.packet)) card.replaceChildren(...NLOSIM.packetCard(view, view.packet).filter(Boolean));
        card.dataset.packet = String(view.packet);
      } else if (!card.matches(":active")) { // a click on a button of it is not lost
        delete card.dataset.packet;
        const k = view.selected >= 0 ? view.selected : view.observer;
        card.replaceChildren(...(k >= 0 ? NLOSIM.vehicleCard(view, k, time) : [el("p", { class: "note" }, "Click a vehicle.")]));
      }
    }

    view.redraw = () => clock.changed();
    view.touched = () => { view.followed = -1; view.redraw(); };
    view.follow = (k) => { view.followed = k; view.redraw(); };
    view.select = (k) => { Object.assign(view, { selected: k, packet: -1 }); made = 0; view.redraw(); };
    view.showPacket = (p) => { view.packet = p; made = 0; view.redraw(); };
    view.observe = (k) => {
      view.observer = k;
      if (listener) listener.value = String(k);
      made = 0;
      view.redraw();
    };
    const zoom = (factor) => { camera.zoom(factor); view.redraw(); };
    const home = () => {
      const k = view.observer >= 0 ? view.observer : crowd.at(clock.time).vehicle[0];
      if (k === undefined) return;
      camera.scale = Math.max(camera.scale, Math.min(camera.width, camera.height) / 130);
      view.follow(k);
    };
    page.key(["+", "=", "-"], "zoom the top view", (event) => zoom(event.key === "-" ? 1 / 1.3 : 1.3));
    page.key(["0"], "show all of it", () => { view.follow(-1); camera.fit(view.bounds()); view.redraw(); });
    page.key(["f"], "follow the listener", home);
    page.key(["Escape"], "choose nothing", () => { view.select(-1); view.follow(-1); });

    NLOSIM.pointer(canvas, view, {
      over: (place) => {
        const found = place && NLOSIM.hit(view, ...place, clock.time);
        const before = view.hovered;
        view.hovered = found && found.vehicle !== undefined ? found.vehicle : -1;
        canvas.style.cursor = found ? "pointer" : "grab";
        tip.hidden = !found;
        if (found) {
          tip.textContent = hint(view, found, clock.time);
          tip.style.left = `${Math.min(place[0] + 14, Math.max(0, camera.width - 190))}px`;
          tip.style.top = `${Math.max(0, place[1] - 34)}px`;
        }
        if (before !== view.hovered) view.redraw();
      },
      click: (place) => {
        const found = NLOSIM.hit(view, ...place, clock.time);
        if (found && found.packet !== undefined) view.showPacket(found.packet);
        else view.select(found ? found.vehicle : -1);
      },
    });

    function resize() {
      const { clientWidth: width, clientHeight: height } = stage;
      if (!width || !height) return;
      const fresh = camera.width === 1;
      camera.ratio = Math.min(2, window.devicePixelRatio || 1);
      Object.assign(canvas, { width: Math.round(width * camera.ratio), height: Math.round(height * camera.ratio) });
      camera.resize(width, height);
      if (fresh && view.opened) camera.show(view.opened);
      else if (fresh) opening();
      paint(clock.time);
    }

    // The picture begins where the run is about somebody, else with everything.
    function opening() {
      camera.fit(view.bounds());
      const all = camera.scale;
      const now = crowd.at(clock.time);
      const n = view.observer >= 0 ? now.row[view.observer] : -1;
      if (n >= 0 && all < 3 && data.egos.length) {
        camera.scale = Math.max(all, Math.min(camera.width, camera.height) / 150);
        view.followed = view.observer;
      }
    }

    new ResizeObserver(resize).observe(stage);
    page.sized.push(resize);
    window.addEventListener("resize", resize); // the density of pixels may change alone
    clock.listen((time, playing) => { paint(time); if (whole.open) tell(time, playing); });
    whole.addEventListener("toggle", () => { resize(); view.redraw(); });
    page.view = view;
    page.kept.push({ name: "top-view", save: () => saved(view), load: (kept) => restore(view, kept, inputs) });
    return [whole];
  }

  const WHO = ["observer", "followed", "selected"];

  // What was chosen, by the numbers of vehicles: another page of the run counts them anew.
  function saved(view) {
    const { x, y, scale, width } = view.camera;
    return { who: Object.fromEntries(WHO.map((name) => [name, view[name] < 0 ? null : view.crowd.ids[view[name]]])),
      choices: Array.from(view.choices), camera: width > 1 ? { x, y, scale } : null };
  }

  function restore(view, kept, inputs) {
    const found = (id) => (id === null ? -1 : view.crowd.ids.indexOf(id));
    if (found(kept.who.observer) >= 0) view.observe(found(kept.who.observer));
    view.select(found(kept.who.selected));
    for (const [name, on] of kept.choices) {
      view.choices.set(name, on);
      if (inputs.has(name)) inputs.get(name).checked = on;
    }
    view.opened = kept.camera;
    if (kept.camera) view.camera.show(kept.camera);
    view.follow(found(kept.who.followed));
  }

  function hint(view, { vehicle, packet }, time) {
    const { crowd, radio } = view;
    if (packet !== undefined) return `${NLOSIM.KINDS[radio.packets.kind[packet]]} ${radio.packets.first + radio.packets.id[packet]}: click for its fate`;
    return `${crowd.title(vehicle)}, ${crowd.kind(vehicle)}, ${NLOSIM.spell(crowd.speed(vehicle, time), 3)} m/s`;
  }

  NLOSIM.layers["top-view"] = { start };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
