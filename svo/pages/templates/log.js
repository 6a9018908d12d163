"use strict";
const boxes = [...document.querySelectorAll("#choice input")];
function show() {
  for (const box of boxes) {
    const figure = [...document.querySelectorAll("figure.drawn")].find((f) => f.dataset.name === box.dataset.shows);
    figure.hidden = !box.checked;
  }
}
for (const box of boxes) box.addEventListener("change", show);
for (const [id, checked] of [["all", true], ["none", false]]) {
  document.getElementById(id).addEventListener("click", () => {
    for (const box of boxes) box.checked = checked;
    show();
  });
}
show();  // a browser may have kept what was chosen before
