// The wiring: components and what is connected; a click tells the signals and the parameters.
(function (NLOSIM) {
  "use strict";

  const { el, svg } = NLOSIM;

  NLOSIM.wiring = function wiring(page, data) {
    const { whole, body } = NLOSIM.section("Wiring", { id: "wiring" });
    const { boxes, edges, width, height } = NLOSIM.layout(data.components, data.connections);
    const about = new Map(data.components.map((each) => [each.name, each]));
    const detail = el("div", { class: "detail" });
    const lines = edges.map((edge) => svg("path", {
      d: edge.path, class: edge.forward ? "edge" : "edge back", "marker-end": "url(#arrow)",
    }, svg("title", {}, edge.connections.map((each) => `${each.from} → ${each.to}`).join("\n"))));
    const marks = (name) => lines.forEach((line, k) => {
      line.classList.toggle("near", name !== null && [edges[k].source, edges[k].target].includes(name));
    });
    let chosen = null;
    const choose = (name) => {
      chosen = chosen === name ? null : name;
      nodes.forEach((node, k) => node.classList.toggle("chosen", boxes[k].name === chosen));
      marks(chosen);
      detail.replaceChildren(...(chosen === null ? [] : told(page, about.get(chosen), data.connections)));
    };
    const nodes = boxes.map((box) => {
      const { type, step, each } = about.get(box.name);
      return svg("g", {
        class: "node", transform: `translate(${box.x},${box.y})`, tabindex: 0, role: "button",
        "aria-label": `component ${box.name}`,
        onclick: () => choose(box.name),
        onkeydown: (event) => { if (event.key === "Enter") choose(box.name); },
        onmouseenter: () => marks(box.name),
        onmouseleave: () => marks(chosen),
      },
      svg("rect", { width: box.width, height: box.height, rx: 5 }),
      svg("text", { x: 10, y: 19, class: "name" }, short(box.name, 22)),
      svg("text", { x: 10, y: 36 }, subtitle(type === box.name ? "" : type, [step && `every ${step}`, each && `one per ${each}`])),
      svg("title", {}, `${box.name}: ${type}`));
    });
    const head = svg("marker", { id: "arrow", viewBox: "0 0 8 8", refX: 7.5, refY: 4, markerWidth: 7,
      markerHeight: 7, orient: "auto" }, svg("path", { d: "M0,0 L8,4 L0,8 z" }));
    body.append(
      el("div", { class: "scroll" }, svg("svg", {
        class: "wiring", viewBox: `0 0 ${width} ${height}`, width, height, role: "img", style: `min-width:${Math.min(width, 480)}px`,
        "aria-label": `${boxes.length} components`,
      }, svg("defs", {}, head), ...lines, ...nodes)),
      el("p", { class: "note" }, "From left to right in the order of turns; dashed: seen a step later. " +
        "Click a component for its signals and parameters."),
      detail,
    );
    return whole;
  };

  // The type gives way to what is behind it.
  function subtitle(type, more) {
    const behind = more.filter(Boolean).join(" · ");
    return [type && short(type, Math.max(6, 24 - behind.length)), behind].filter(Boolean).join(" · ");
  }

  const short = (text, most) => (text.length > most ? `${text.slice(0, most - 1)}…` : text);

  function told(page, component, connections) {
    const links = (end, other) => {
      const found = connections.filter((each) => each[end] === component.name);
      return el("ul", {}, found.map((each) => el("li", {}, each.from, " → ", each.to,
        each.way ? ` (${each.way})` : "")), found.length ? null : el("li", {}, `no ${other}`));
    };
    const curves = page.curves.filter((curve) => curve.name.startsWith(`${component.name}.`));
    return [
      el("h3", {}, component.name, " ", el("small", {}, component.type)),
      el("div", { class: "columns" },
        el("div", {}, el("h4", {}, "reads"), links("target", "inputs")),
        el("div", {}, el("h4", {}, "is read"), links("source", "outputs")),
        el("div", {}, el("h4", {}, "numbers over time"), el("ul", { class: "picks" }, curves.map((curve) =>
          el("li", {}, el("button", { type: "button", class: "link", onclick: () => page.offer(curve) },
            curve.name.slice(component.name.length + 1)))), curves.length ? null : el("li", {}, "none is recorded"))),
        el("div", {}, el("h4", {}, "parameters"), NLOSIM.tree(component.parameters))),
    ];
  }
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
