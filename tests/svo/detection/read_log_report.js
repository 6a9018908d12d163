// Moves in a report on a log as a reader would, and leaves what was seen in an element that the test reads.
addEventListener("load", () => {
  const figures = () => [...document.querySelectorAll("figure.drawn")].filter((f) => f.offsetHeight > 0).length;
  const boxes = [...document.querySelectorAll("#choice input")];
  const seen = { errors: window.errors };
  seen.loaded = performance.getEntriesByType("resource").map((entry) => entry.name);
  seen.overflow = document.documentElement.scrollWidth - innerWidth;
  seen.begin = figures();
  boxes[0].click();
  seen.one = [figures(), document.querySelectorAll("figure.drawn")[1].offsetHeight];
  document.getElementById("none").click();
  seen.none = [figures(), boxes.some((box) => box.checked)];
  document.getElementById("all").click();
  seen.all = [figures(), boxes.every((box) => box.checked)];
  const svg = document.querySelector("figure.drawn svg");
  const bar = [...svg.querySelectorAll("path")].map((path) => getComputedStyle(path).fill);
  seen.colours = [...new Set(bar)];
  seen.size = [svg.getBoundingClientRect().width, svg.getBoundingClientRect().height];
  const details = document.querySelector("details");
  details.open = true;
  seen.description = details.querySelector("pre").innerText.includes("[model]");
  seen.overflowOpen = document.documentElement.scrollWidth - innerWidth;
  const result = document.createElement("pre");
  result.id = "seen";
  result.textContent = JSON.stringify(seen);
  document.body.append(result);
});
