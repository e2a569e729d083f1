// Follows a run: takes the place of its page by each newer one, at the same time and with the same choices.
(function (LIVE) {
  "use strict";

  const POLL = 500; // [ms]
  const SLOWEST = 0.05; // simulated seconds per second
  const FASTEST = 30;
  const CALM = 50; // the run needs the processor more than pictures: so long between two of them [ms]

  // How fast to play what is `left` [s] of a page, so that the next page comes, in `wait` [s], when it ends.
  LIVE.pace = (left, wait) => Math.min(FASTEST, Math.max(SLOWEST, left / Math.max(wait, 0.1)));

  // What is said: `shown` is the time of the picture, `state` what the server last knew.
  LIVE.words = function words({ status, reached, problem }, shown, isFollowing) {
    if (problem) return problem;
    const [of, is] = [reached.toFixed(2), shown.toFixed(2)];
    if (status !== "running") return `The run is ${status} at ${of} s. Shown: ${is} s.`;
    const lag = Math.max(0, reached - shown).toFixed(2);
    return `The run is at ${of} s. Shown: ${is} s, ${lag} s behind${isFollowing ? "" : "; it is not followed"}.`;
  };

  // Whether the reader has stopped or moved the time: `told` is what was told to the clock last, `now` [ms].
  LIVE.isTouched = function isTouched(told, clock, now) {
    if (!clock.playing && clock.time < clock.span) return true;
    const most = told.time + ((now - told.at) / 1000) * told.speed;
    return clock.speed !== told.speed || clock.time < told.time - 1e-9 || clock.time > most + 0.5 * Math.max(1, told.speed);
  };

  // A page that plays is drawn less often while the run goes on; who moves it does not wait.
  LIVE.calm = (clock, window, isRunning) => {
    const soon = (next) => window.requestAnimationFrame(next);
    clock.frame = (next) => (clock.playing && isRunning() ? window.setTimeout(soon, CALM, next) : soon(next));
  };

  LIVE.start = function start(document, fetch) {
    const at = (id) => document.getElementById(id);
    const [name, follow, lag, frames] = ["name", "follow", "lag", "frames"].map(at);
    let current = null; // the iframe that is seen
    let version = 0;
    let isFollowing = true;
    let state = null;
    let told = null;
    let coming = false;
    const page = () => current.contentWindow.NLOSIM.page;

    // Plays on, towards the end of the page.
    function play() {
      const { clock } = page();
      const left = clock.span - clock.time;
      clock.speed = state.status === "running" ? LIVE.pace(left, state.wait) : 1;
      clock.playing = left > 0;
      clock.before = null;
      clock.changed();
      told = { time: clock.time, speed: clock.speed, at: performance.now() };
    }

    function look() {
      if (!current) return;
      const { clock, start } = page();
      if (isFollowing && told && LIVE.isTouched(told, clock, performance.now())) isFollowing = false;
      follow.hidden = state.status !== "running" && !isFollowing;
      follow.textContent = isFollowing ? "Stop following" : "Follow the run";
      follow.setAttribute("aria-pressed", String(isFollowing));
      lag.textContent = LIVE.words(state, start + clock.time, isFollowing);
      lag.classList.toggle("alarm", Boolean(state.problem));
    }

    function swap(frame, number) {
      const saved = current ? page().save() : null;
      if (current) current.remove();
      const isFirst = current === null;
      current = frame;
      version = number;
      coming = false;
      frame.classList.remove("coming");
      LIVE.calm(page().clock, frame.contentWindow, () => state.status === "running");
      if (saved) page().restore(saved);
      if (isFirst && state.status === "running") page().clock.seek(page().clock.span);
      document.title = frame.contentDocument.title;
      name.textContent = frame.contentDocument.title;
      if (isFollowing && (state.status === "running" || !isFirst)) play();
      else if (isFirst) isFollowing = false;
      look();
    }

    function load(number) {
      coming = true;
      const frame = document.createElement("iframe");
      frame.className = "coming";
      frame.title = "page of the run";
      frame.src = `page/${number}.html`;
      frames.append(frame);
      const ready = () => {
        const inside = frame.contentWindow && frame.contentWindow.NLOSIM;
        if (inside && inside.page && inside.page.ready) swap(frame, number);
        else if (frame.contentDocument && frame.contentDocument.querySelector(".alarm[role=alert]")) swapFailed(frame);
        else setTimeout(ready, 30);
      };
      ready();
    }

    function swapFailed(frame) {
      frame.remove();
      coming = false;
    }

    async function poll() {
      try {
        const answer = await fetch("state.json", { cache: "no-store" });
        state = await answer.json();
      } catch {
        state = { ...(state || { status: "unknown", reached: 0, wait: 1, version: 0 }), problem: "`nlosim view` has ended: nothing new comes." };
      }
      if (!current) lag.textContent = state.problem || "Waiting for the first page of the run …";
      if (state.version > version && !coming) load(state.version);
      look();
      setTimeout(poll, POLL);
    }

    follow.addEventListener("click", () => {
      isFollowing = !isFollowing;
      if (isFollowing) play();
      else page().clock.play(false);
      look();
    });
    setInterval(look, 100);
    poll();
  };
})((globalThis.LIVE = globalThis.LIVE || {}));
if (globalThis.document) LIVE.start(document, fetch.bind(globalThis));
