// What keys do, and the help that says it.
(function (NLOSIM) {
  "use strict";

  const { el } = NLOSIM;

  NLOSIM.keys = function keys(page) {
    const known = [];
    const dialog = el("dialog", { class: "help", "aria-label": "keys" });
    document.body.append(dialog);

    page.key = (names, what, act) => known.push({ names, what, act });
    page.help = () => {
      dialog.replaceChildren(
        el("h2", {}, "Keys"),
        el("dl", { class: "keys" }, known.flatMap(({ names, what }) =>
          [el("dt", {}, names.map((name) => el("kbd", {}, name === " " ? "space" : name.replace("Arrow", "")))), el("dd", {}, what)])),
        el("p", { class: "note" }, page.hint || ""),
        el("form", { method: "dialog" }, el("button", { autofocus: true }, "close")),
      );
      dialog.showModal();
    };

    page.key(["?"], "this help", () => page.help());

    document.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || dialog.open) return;
      const { tagName, type } = event.target;
      const writes = tagName === "SELECT" || tagName === "TEXTAREA" || (tagName === "INPUT" && !["range", "checkbox", "radio"].includes(type));
      if (writes) return;
      if ([" ", "Enter"].includes(event.key) && (["BUTTON", "SUMMARY"].includes(tagName) || type === "checkbox")) return;
      const found = known.find(({ names }) => names.includes(event.key));
      if (!found) return;
      event.preventDefault();
      found.act(event);
    });
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
