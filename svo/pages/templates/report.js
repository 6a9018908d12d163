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
  const room = (svg) => Math.max(300, Math.min(760, svg.parentElement.clientWidth));  // drawn in pixels: text keeps its size
  const size = (svg, width, height) => {
    svg.replaceChildren();
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    svg.style.width = `${width}px`;
  };

  // Every run: one column a fault, profile, noise set and bank; delays on a logarithmic scale.
  const everyRun = () => {
    const svg = document.getElementById("runs");
    const readout = document.getElementById("run");
    const runs = data.runs.filter((run) => run.fault !== "none");
    const several = (key) => new Set(runs.map((run) => run[key])).size > 1;
    const noises = several("noise"), banks = several("among");
    const kind = (run) => [run.fault, run.profile, ...(noises ? [run.noise] : []),
      ...(banks ? [run.among] : [])].join("\n");
    const kinds = [...new Set(runs.map(kind))];
    const reached = runs.flatMap((run) => [run.detect, run.isolate]).filter((value) => value > 0);
    if (!reached.length) reached.push(data.Ts);
    const low = Math.floor(Math.log10(reached.reduce((a, b) => Math.min(a, b))));
    const high = Math.max(low + 1, Math.ceil(Math.log10(reached.reduce((a, b) => Math.max(a, b)))));
    let dots = [], chosen = 0;

    const choose = (k) => {
      for (const dot of dots[chosen]) dot.classList.remove("chosen");
      for (const dot of dots[k]) dot.classList.add("chosen");
      chosen = k;
      const run = runs[k];
      const notes = [run.as && run.as !== run.fault ? ` as ${run.as}` : "", run.false ? "; false alarm" : "", run.wrong ? "; wrong isolation" : ""];
      const bank = run.bank ? `, ${run.bank}` : "";
      readout.textContent = `${run.fault}, ${run.profile}, ${run.noise} noise${bank}, run ${run.run}: detected ${seconds(run.detect)}, `
        + `isolated ${seconds(run.isolate)}${notes.join("")}. `;
      const fault = /^[\w.-]+$/.test(run.fault) ? run.fault : `"${run.fault}"`;
      const command = document.createElement("code");
      for (const part of [`svo simulate ${data.plant}`, `--fault ${fault}`, `--profile ${run.profile}`, `--noise ${run.noise}`,
        `--seed ${run.seed}`, "--out LOG.csv"]) {
        const unbroken = document.createElement("span");
        unbroken.textContent = part;
        command.append(unbroken, " ");
      }
      readout.append(command);
    };

    const draw = () => {
      const left = 50, top = 44, height = 260, never = 24;
      const column = Math.max(30, Math.min(78, (room(svg) - left - 8) / kinds.length));
      const upright = column < 62;
      const lines = noises + banks + 2;
      const width = Math.max(300, left + column * kinds.length + 8), foot = top + never + height;
      size(svg, width, foot + (upright ? 16 + 7 * Math.max(...kinds.map((name) => name.length)) : 10 + 15 * lines));
      const y = (value) => (value === null ? top : top + never + height * (high - Math.log10(value)) / (high - low));
      node(svg, "text", { x: 0, y: 12 }, "time after the fault");
      ["detect", "isolate"].forEach((what, i) => {
        node(svg, "circle", { cx: 150 + 80 * i, cy: 8, r: 4, class: what });
        node(svg, "text", { x: 158 + 80 * i, y: 12 }, ["detected", "isolated"][i]);
      });
      if (runs.some((run) => run.isolate === null || run.detect === null)) {
        node(svg, "text", { x: left - 6, y: top + 4, "text-anchor": "end" }, "never");
      }
      for (let power = low; power <= high; power += 1) {
        const at = y(10 ** power);
        node(svg, "line", { x1: left, x2: width - 8, y1: at, y2: at, class: "grid" });
        node(svg, "text", { x: left - 6, y: at + 4, "text-anchor": "end" }, `${+(10 ** power).toPrecision(1)} s`);
      }
      kinds.forEach((name, i) => {
        const x = left + column * (i + 0.5);
        if (upright) {
          node(svg, "text", { x: x + 4, y: foot + 12, "text-anchor": "end", transform: `rotate(-90 ${x + 4} ${foot + 12})` }, name.replaceAll("\n", " "));
        } else {
          name.split("\n").forEach((line, j) => node(svg, "text", { x, y: foot + 18 + 15 * j, "text-anchor": "middle" }, line));
        }
      });
      const placed = new Map();
      const radius = runs.length > 500 ? 2.5 : 4;
      dots = runs.map((run) => {
        const i = kinds.indexOf(kind(run));
        const count = placed.get(i) || 0;
        placed.set(i, count + 1);
        const spread = (((count * 7) % 19) - 9) * column / 78;  // beside each other, always in the same way
        return ["detect", "isolate"].map((what, side) => node(svg, "circle",
          { cx: left + column * (i + (side ? 0.73 : 0.27)) + spread, cy: y(run[what]), r: radius, class: what }));
      });
      choose(chosen);
    };

    const nearest = (event) => {  // a finger need not hit the dot
      const box = svg.getBoundingClientRect();
      let best = null, least = 24 ** 2;
      dots.forEach((pair, k) => pair.forEach((dot) => {
        const distance = (dot.cx.baseVal.value - event.clientX + box.left) ** 2 + (dot.cy.baseVal.value - event.clientY + box.top) ** 2;
        if (distance < least) [best, least] = [k, distance];
      }));
      if (best !== null && best !== chosen) choose(best);
    };
    svg.addEventListener("pointermove", nearest);
    svg.addEventListener("click", nearest);
    svg.addEventListener("keydown", (event) => {
      const to = { ArrowRight: chosen + 1, ArrowLeft: chosen - 1, Home: 0, End: runs.length - 1 }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      choose((to + runs.length) % runs.length);
    });
    return draw;
  };

  // One run: the boxes of the models alive, and a strip of who is alive when.
  const oneRun = () => {
    const svg = document.getElementById("sets");
    const [choice, slider, play] = ["flight", "time", "play"].map((id) => document.getElementById(id));
    const readout = document.getElementById("sample");
    let timer = null;

    const drawSets = (flight, k, alive, frame) => {
      const { left, top, right, bottom } = frame;
      const two = flight.axes.length > 1;
      // The view is centred on the truth and as large as the sets of this and the next samples, so that shrinking is seen.
      const half = flight.axes.map((_, axis) => {
        let largest = 1e-12;
        for (let q = Math.max(0, k - 5); q < Math.min(flight.time.length, k + 6); q += 1) {
          for (const model of flight.models) {
            for (const bound of [model.lower[q][axis], model.upper[q][axis]]) {
              if (bound !== null) largest = Math.max(largest, Math.abs(bound - flight.true[q][axis]));
            }
          }
        }
        return 1.1 * largest;
      });
      const within = (value, axis, none) => (value === null ? none : Math.max(-1, Math.min(1, (value - flight.true[k][axis]) / half[axis])));
      const x = (part) => left + (right - left) * (1 + part) / 2;
      const y = (part) => top + (bottom - top) * (1 - part) / 2;
      node(svg, "rect", { x: left, y: top, width: right - left, height: bottom - top, class: "frame" });
      for (const part of [-0.8, 0, 0.8]) {
        node(svg, "text", { x: x(part), y: bottom + 16, "text-anchor": "middle" }, (flight.true[k][0] + part * half[0]).toPrecision(4));
        if (two) node(svg, "text", { x: left - 6, y: y(part) + 4, "text-anchor": "end" }, (flight.true[k][1] + part * half[1]).toPrecision(3));
      }
      node(svg, "text", { x: (left + right) / 2, y: bottom + 34, "text-anchor": "middle" }, flight.axes[0]);
      if (two) node(svg, "text", { x: 0, y: 12 }, flight.axes[1]);
      for (const model of alive) {
        const [x0, x1] = [within(model.lower[k][0], 0, -1), within(model.upper[k][0], 0, 1)];
        const [y0, y1] = two ? [within(model.lower[k][1], 1, -1), within(model.upper[k][1], 1, 1)] : [-0.1, 0.1];
        node(svg, "rect", { x: x(x0), y: y(y1), width: x(x1) - x(x0), height: y(y0) - y(y1), fill: model.colour, stroke: model.colour, class: "set" });
      }
      node(svg, "path", { d: `M${x(0) - 6} ${y(0) - 6}l12 12m0 -12l-12 12`, class: "truth" });
    };

    const drawLives = (flight, k, alive, frame) => {
      const { left, top, right } = frame;
      const [first, last] = [flight.time[0], flight.time.at(-1)];
      const at = (time) => left + (right - left) * (time - first) / Math.max(1e-12, last - first);
      flight.models.forEach((model, i) => {
        const line = top + 18 * i;
        const end = model.dies === null ? last : flight.time[Math.max(0, model.dies)];
        node(svg, "text", { x: left - 6, y: line + 9, "text-anchor": "end", class: alive.includes(model) ? "" : "dead" }, model.name);
        node(svg, "rect", { x: left, y: line, width: Math.max(1, at(end) - left), height: 10, fill: model.colour,
          opacity: alive.includes(model) ? 1 : 0.35 });
      });
      const foot = top + 18 * flight.models.length;
      node(svg, "line", { x1: at(flight.time[k]), x2: at(flight.time[k]), y1: top - 6, y2: foot, class: "now" });
      node(svg, "text", { x: left, y: foot + 16 }, `${first.toFixed(2)} s`);
      node(svg, "text", { x: right, y: foot + 16, "text-anchor": "end" }, `${last.toFixed(2)} s`);
      if (first >= 0 || last <= 0) return;
      node(svg, "line", { x1: at(0), x2: at(0), y1: top - 6, y2: foot, class: "fault" });
      node(svg, "text", { x: at(0), y: foot + 16, "text-anchor": "middle" }, "fault");
    };

    const draw = () => {
      const flight = data.flights[+choice.value];
      const k = +slider.value;
      const alive = flight.models.filter((model) => model.dies === null || k < model.dies);
      const width = room(svg), left = 12 + 7 * Math.max(7, ...flight.models.map((model) => model.name.length));
      const bottom = 24 + Math.min(370, 0.72 * (width - left));
      size(svg, width, bottom + 56 + 18 * flight.models.length + 24);
      drawSets(flight, k, alive, { left, top: 24, right: width - 8, bottom });
      drawLives(flight, k, alive, { left, top: bottom + 56, right: width - 8 });
      const time = flight.time[k];
      const when = `${Math.abs(time).toFixed(3)} s ${time < 0 ? "before" : "after"} the fault`;
      const fallen = flight.models.filter((model) => !alive.includes(model)).map((model) => model.name);
      readout.textContent = `${when}; alive: ${alive.map((model) => model.name).join(", ") || "none"}`
        + `${fallen.length ? `; falsified: ${fallen.join(", ")}` : ""}`;
      slider.setAttribute("aria-valuetext", when);
    };
    const stop = () => {
      clearInterval(timer);
      timer = null;
      play.textContent = "Play";
    };
    const begin = () => {
      stop();
      slider.max = data.flights[+choice.value].time.length - 1;
      slider.value = 0;
      draw();
    };
    slider.addEventListener("input", draw);
    choice.addEventListener("change", begin);
    play.addEventListener("click", () => {
      if (timer !== null) { stop(); return; }
      if (slider.value === slider.max) slider.value = 0;
      play.textContent = "Pause";
      timer = setInterval(() => {
        if (slider.value === slider.max) { stop(); return; }
        slider.value = +slider.value + 1;
        draw();
      }, 60);
    });
    begin();
    return draw;
  };

  const views = [everyRun(), oneRun()];
  const draw = () => views.forEach((view) => view());
  draw();
  addEventListener("resize", draw);
})();
