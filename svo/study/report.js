"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const SVG = "http://www.w3.org/2000/svg";
  const node = (parent, name, attributes, text) => {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    parent.append(made);
    return made;
  };
  const seconds = (value) => (value === null ? "not reached" : `${+value.toFixed(4)} s`);

  // Every run: one column a fault, profile and noise set; delays on a logarithmic scale.
  const drawRuns = () => {
    const svg = document.getElementById("runs");
    const readout = document.getElementById("run");
    const runs = data.runs.filter((run) => run.fault !== "none");
    const kind = (run) => [run.fault, run.profile, run.noise].join("\n");
    const kinds = [...new Set(runs.map(kind))];
    const reached = runs.flatMap((run) => [run.detect, run.isolate]).filter((value) => value > 0);
    if (!reached.length) return;
    const low = Math.floor(Math.log10(Math.min(...reached)));
    const high = Math.max(low + 1, Math.ceil(Math.log10(Math.max(...reached))));
    const left = 62, top = 14, column = 74, height = 260, never = 22;
    const width = left + column * kinds.length + 10;
    svg.setAttribute("viewBox", `0 0 ${width} ${top + height + never + 62}`);
    svg.style.width = `${width}px`;
    const y = (value) => (value === null ? top : top + never + height * (high - Math.log10(value)) / (high - low));
    node(svg, "text", { x: left - 6, y: top + 4, "text-anchor": "end" }, "not reached");
    for (let power = low; power <= high; power += 1) {
      const at = y(10 ** power);
      node(svg, "line", { x1: left, x2: width - 10, y1: at, y2: at, class: "grid" });
      node(svg, "text", { x: left - 6, y: at + 4, "text-anchor": "end" }, `${+(10 ** power).toPrecision(1)} s`);
    }
    kinds.forEach((name, i) => name.split("\n").forEach((line, j) => node(
      svg, "text", { x: left + column * (i + 0.5), y: top + never + height + 18 + 14 * j, "text-anchor": "middle" }, line)));
    const dots = [];
    const show = (k) => {
      dots.forEach((pair, i) => pair.forEach((dot) => dot.classList.toggle("chosen", i === k)));
      const run = runs[k];
      readout.textContent = `${run.fault}, ${run.profile}, ${run.noise} noise, run ${run.run}: detected ${seconds(run.detect)}, `
        + `isolated ${seconds(run.isolate)}${run.as && run.as !== run.fault ? ` (as ${run.as})` : ""}. `
        + `svo simulate ${data.plant} --fault "${run.fault}" --profile ${run.profile} --noise ${run.noise} --seed ${run.seed} --out LOG.csv`;
    };
    const placed = new Map();
    runs.forEach((run, k) => {
      const i = kinds.indexOf(kind(run));
      const count = placed.get(i) || 0;
      placed.set(i, count + 1);
      const spread = ((count * 7) % 19) - 9;  // beside each other, always in the same way
      const centre = left + column * (i + 0.5);
      dots.push(["detect", "isolate"].map((what, side) => {
        const dot = node(svg, "circle", { cx: centre + (side ? 17 : -17) + spread, cy: y(run[what]), r: 4, class: what, tabindex: 0 });
        for (const event of ["pointerenter", "focus", "click"]) dot.addEventListener(event, () => show(k));
        return dot;
      }));
    });
    svg.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      const at = dots.findIndex((pair) => pair.includes(document.activeElement));
      if (!step || at < 0) return;
      event.preventDefault();
      dots[(at + step + dots.length) % dots.length][0].focus();
    });
    show(0);
  };

  // One run: the boxes of the models alive, and a strip of who is alive when.
  const drawFlight = () => {
    const svg = document.getElementById("sets");
    const [choice, slider, play] = ["flight", "time", "play"].map((id) => document.getElementById(id));
    const readout = document.getElementById("sample");
    const width = 640, height = 400, left = 70, bottom = 46, strip = 18;
    let timer = null;

    const frame = () => {
      const flight = data.flights[+choice.value];
      const k = +slider.value;
      const two = flight.axes.length > 1;
      const alive = flight.models.filter((model) => model.lower[k][0] !== null);
      svg.replaceChildren();
      svg.setAttribute("viewBox", `0 0 ${width} ${height + bottom + strip * flight.models.length + 34}`);
      // The view is centred on the truth and as large as the sets of this and the next samples, so that shrinking is seen.
      const from = Math.max(0, k - 5), to = Math.min(flight.time.length, k + 6);
      const half = flight.axes.map((_, axis) => {
        let largest = 1e-12;
        for (let q = from; q < to; q += 1) {
          for (const model of flight.models) {
            if (model.lower[q][axis] === null) continue;
            largest = Math.max(largest, flight.true[q][axis] - model.lower[q][axis], model.upper[q][axis] - flight.true[q][axis]);
          }
        }
        return 1.1 * largest;
      });
      const scale = (axis, value) => (value - flight.true[k][axis]) / half[axis];
      const x = (value) => left + (width - left - 10) * (1 + scale(0, value)) / 2;
      const y = (value) => (two ? 10 + (height - 20) * (1 - scale(1, value)) / 2 : height / 2);
      node(svg, "rect", { x: left, y: 10, width: width - left - 10, height: height - 20, class: "frame" });
      for (const part of [-0.8, 0, 0.8]) {
        const value = flight.true[k][0] + part * half[0];
        node(svg, "text", { x: x(value), y: height + 8, "text-anchor": "middle" }, value.toPrecision(4));
        if (!two) continue;
        const other = flight.true[k][1] + part * half[1];
        node(svg, "text", { x: left - 6, y: y(other) + 4, "text-anchor": "end" }, other.toPrecision(4));
      }
      node(svg, "text", { x: (left + width) / 2, y: height + 28, "text-anchor": "middle" }, flight.axes[0]);
      if (two) node(svg, "text", { x: 14, y: height / 2, "text-anchor": "middle", transform: `rotate(-90 14 ${height / 2})` }, flight.axes[1]);
      for (const model of alive) {
        const [lower, upper] = [model.lower[k], model.upper[k]];
        const tall = two ? y(lower[1]) - y(upper[1]) : 24;
        node(svg, "rect", { x: x(lower[0]), y: two ? y(upper[1]) : y(0) - 12, width: x(upper[0]) - x(lower[0]), height: tall,
          fill: model.colour, stroke: model.colour, class: "set" });
      }
      const [cx, cy] = [x(flight.true[k][0]), two ? y(flight.true[k][1]) : height / 2];
      node(svg, "path", { d: `M${cx - 6} ${cy - 6}l12 12m0 -12l-12 12`, class: "truth" });
      const at = (q) => left + (width - left - 10) * q / Math.max(1, flight.time.length - 1);
      flight.models.forEach((model, i) => {
        const line = height + bottom + strip * i;
        const last = model.lower.reduce((found, lower, q) => (lower[0] === null ? found : q), 0);
        node(svg, "text", { x: left - 6, y: line + 9, "text-anchor": "end", class: alive.includes(model) ? "" : "dead" }, model.name);
        node(svg, "rect", { x: left, y: line, width: Math.max(1, at(last) - left), height: 10, fill: model.colour,
          opacity: alive.includes(model) ? 1 : 0.35 });
      });
      const foot = height + bottom + strip * flight.models.length;
      node(svg, "line", { x1: at(k), x2: at(k), y1: height + bottom - 6, y2: foot, class: "now" });
      const fault = flight.time.findIndex((value) => value >= 0);
      if (fault >= 0) {
        node(svg, "line", { x1: at(fault), x2: at(fault), y1: height + bottom - 6, y2: foot, class: "fault" });
        node(svg, "text", { x: at(fault), y: foot + 16, "text-anchor": "middle" }, "fault");
      }
      readout.textContent = `${flight.time[k].toFixed(3)} s after the fault; alive: ${alive.map((model) => model.name).join(", ") || "none"}`;
    };
    const stop = () => {
      clearInterval(timer);
      timer = null;
      play.textContent = "Play";
    };
    const begin = () => {
      slider.max = data.flights[+choice.value].time.length - 1;
      slider.value = 0;
      frame();
    };
    slider.addEventListener("input", frame);
    choice.addEventListener("change", () => { stop(); begin(); });
    play.addEventListener("click", () => {
      if (timer !== null) { stop(); return; }
      if (slider.value === slider.max) slider.value = 0;
      play.textContent = "Pause";
      timer = setInterval(() => {
        if (slider.value === slider.max) { stop(); return; }
        slider.value = +slider.value + 1;
        frame();
      }, 60);
    });
    if (data.flights.length) begin();
  };

  drawRuns();
  drawFlight();
})();
