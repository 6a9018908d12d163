// Moves in a report as a reader would, and leaves what was seen in an element that the test reads.
addEventListener("load", async () => {
  const find = (id) => document.getElementById(id);
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  const sets = () => find("sets").querySelectorAll(".set").length;
  const texts = () => [...find("sets").querySelectorAll("text")].map((text) => text.textContent);
  const seen = { errors: window.errors };
  seen.loaded = performance.getEntriesByType("resource").map((entry) => entry.name);
  seen.overflow = document.documentElement.scrollWidth - innerWidth;
  seen.dots = find("runs").querySelectorAll("circle").length;
  seen.table = document.querySelector("table").innerText;

  seen.firstRun = find("run").textContent;
  find("runs").dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
  seen.nextRun = find("run").textContent;
  const circles = find("runs").querySelectorAll("circle");
  const box = circles[circles.length - 1].getBoundingClientRect();
  find("runs").dispatchEvent(new PointerEvent("pointermove", { clientX: box.x + box.width / 2, clientY: box.y + box.height / 2 }));
  seen.pointedRun = find("run").textContent;
  seen.marked = find("runs").querySelectorAll("circle.chosen").length;

  seen.begin = [find("sample").textContent, sets()];
  find("time").value = find("time").max;
  find("time").dispatchEvent(new Event("input"));
  seen.end = [find("sample").textContent, sets()];
  seen.struck = [...find("sets").querySelectorAll(".dead")].map((text) => text.textContent);
  const before = texts();
  find("flight").value = "1";
  find("flight").dispatchEvent(new Event("change"));
  seen.otherFlight = [find("sample").textContent, sets()];
  seen.redrawn = texts().join() !== before.join();

  find("play").click();
  await wait(400);
  seen.playing = [find("play").textContent, +find("time").value];
  find("play").click();
  seen.paused = find("play").textContent;
  dispatchEvent(new Event("resize"));
  const result = document.createElement("pre");
  result.id = "seen";
  result.textContent = JSON.stringify(seen);
  document.body.append(result);
});
