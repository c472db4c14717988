"use strict";
for (const figure of document.querySelectorAll("figure.view")) {
  const data = JSON.parse(figure.querySelector("script").textContent);
  const svg = figure.querySelector("svg"), controls = figure.querySelector(".controls");
  const box = svg.viewBox.baseVal, d = data.centre.length;
  const marks = data.layers.map((_, k) => svg.querySelector(`[data-layer="${k}"]`));
  const moving = data.layers.some(one => one.moves);
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const eyes = {oblique: [data.turn, data.rise], above: [0, 90], front: [0, 0], right: [-90, 0]};
  let [turn, rise] = eyes.oblique, zoom = 1, swing = 1, playing = false, seen = false, started = 0;

  const directions = () => {
    if (d === 2) return [[1, 0], [0, 1]];
    const t = turn * Math.PI / 180, r = rise * Math.PI / 180;
    const right = [Math.cos(t), -Math.sin(t), 0];
    return [right, [Math.sin(t) * Math.sin(r), Math.cos(t) * Math.sin(r), Math.cos(r)]];
  };
  const ellipse = (at, B) => {
    // Principal axes of B B', as a singular value decomposition has them.
    const a = B[0].reduce((s, v) => s + v * v, 0), c = B[1].reduce((s, v) => s + v * v, 0);
    const b = B[0].reduce((s, v, i) => s + v * B[1][i], 0);
    const middle = (a + c) / 2, apart = Math.hypot((a - c) / 2, b);
    const angle = Math.atan2(2 * b, a - c) / 2;
    const long = Math.sqrt(middle + apart), short = Math.sqrt(Math.max(middle - apart, 0));
    const x = long * Math.cos(angle), y = -long * Math.sin(angle), f = v => v.toFixed(1);
    const arc = `a${f(long)} ${f(short)} ${(-angle * 180 / Math.PI).toFixed(0)} 1 0`;
    return `M${f(at[0] - x)} ${f(at[1] - y)}${arc} ${f(2 * x)} ${f(2 * y)}${arc} ${f(-2 * x)} ${f(-2 * y)}`;
  };
  const draw = () => {
    const [right, up] = directions(), scale = data.scale * zoom;
    data.layers.forEach((one, k) => {
      const count = one.points.length / d, paper = new Array(count);
      for (let i = 0; i < count; i++) {
        let x = 0, y = 0;
        for (let j = 0; j < d; j++) {
          const move = one.moves ? swing * one.moves[i * d + j] : 0;
          const v = one.points[i * d + j] + move - data.centre[j];
          x += v * right[j]; y += v * up[j];
        }
        paper[i] = [Math.round(10 * (box.width / 2 + scale * x)) / 10,
          Math.round(10 * (box.height / 2 - scale * y)) / 10];
      }
      const mark = marks[k];
      if (one.kind === "labels") {
        [...mark.children].forEach((text, i) => {
          text.setAttribute("x", paper[i][0]); text.setAttribute("y", paper[i][1]);
        });
        return;
      }
      let path = "";
      if (one.kind === "dots") for (const p of paper) path += `M${p[0]} ${p[1]}h0`;
      else if (one.kind === "ellipsoids") paper.forEach((p, i) => {
        const B = [right, up].map(e => [...Array(d).keys()].map(j =>
          scale * e.reduce((s, v, m) => s + v * one.shapes[(i * d + m) * d + j], 0)));
        path += ellipse(p, B);
      });
      else {
        let first = 0;
        for (const size of one.sizes) {
          path += "M" + paper.slice(first, first += size).map(p => p.join(" ")).join("L") + (one.kind === "areas" ? "Z" : "");
        }
      }
      mark.setAttribute("d", path);
    });
  };
  const play = controls.querySelector("[data-play]");
  const step = now => {
    if (!playing || !seen) return;
    swing = Math.sin((now - started) / 600);
    draw();
    requestAnimationFrame(step);
  };
  const set = on => {
    playing = on;
    play.setAttribute("aria-pressed", on);
    play.textContent = on ? "stop" : "move";
    started = performance.now();
    if (on) requestAnimationFrame(step); else { swing = 1; draw(); }
  };
  const look = (t, r) => {
    turn = t; rise = Math.min(90, Math.max(-90, r));
    if (!playing) draw();
  };
  const enlarge = by => { zoom = Math.min(8, Math.max(0.25, zoom * by)); if (!playing) draw(); };
  controls.hidden = false;
  controls.addEventListener("click", event => {
    const {view, zoom: by} = event.target.dataset;
    if (view) look(...eyes[view]);
    if (by) enlarge(Number(by));
    if (event.target === play) set(!playing);
  });
  if (d === 3) {
    svg.addEventListener("keydown", event => {
      const by = {ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5]}[event.key];
      if (by) look(turn + by[0], rise + by[1]);
      else if (event.key === "Home") { zoom = 1; look(...eyes.oblique); }
      else if (event.key === "+" || event.key === "-") enlarge(event.key === "+" ? 1.25 : 0.8);
      else return;
      event.preventDefault();
    });
    let held = null;
    svg.addEventListener("pointerdown", event => {
      held = [event.clientX, event.clientY, turn, rise];
      svg.setPointerCapture(event.pointerId);
    });
    svg.addEventListener("pointermove", event => {
      if (held) look(held[2] + (event.clientX - held[0]) / 2, held[3] + (event.clientY - held[1]) / 2);
    });
    for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => { held = null; });
  }
  if (moving) {
    new IntersectionObserver(entries => {
      seen = entries[entries.length - 1].isIntersecting;
      if (seen && playing) requestAnimationFrame(step);
    }).observe(svg);
    if (!still.matches) set(true);
    still.addEventListener("change", () => set(!still.matches));
    addEventListener("beforeprint", () => set(false));
  }
}
