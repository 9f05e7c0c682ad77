"""Script of ``network.html``: zoom and pan of the map, marked sites, and sorting of the table."""

SCRIPT = r"""
"use strict";
const map = document.getElementById("map"), marks = [...map.querySelectorAll(".mark")];
const whole = map.getAttribute("viewBox").split(" ").map(Number), bar = document.querySelector(".scale");
let view = [...whole], drag = null;
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
function draw() {
  const unit = view[2] / map.clientWidth, longest = unit * Number(map.dataset.metres) * 150;
  const decade = 10 ** Math.floor(Math.log10(longest));
  const size = [5, 2, 1].find(step => step * decade <= longest) * decade;
  const share = clamp(map.clientWidth / 900, 0.6, 1), scale = unit * share;
  for (const one of document.querySelectorAll(".legend svg")) {
    one.style.width = `${one.getAttribute("width") * share}px`;
  }
  map.setAttribute("viewBox", view.join(" "));
  map.style.touchAction = view[2] < whole[2] ? "pinch-zoom" : "";
  for (const mark of marks) mark.setAttribute("transform", `translate(${mark.dataset.at}) scale(${scale})`);
  bar.style.width = `${size / longest * 150}px`;
  bar.nextElementSibling.textContent = size < 1000 ? `${+size.toPrecision(1)} m` : `${size / 1000} km`;
}
function show(x, y, width) {
  const wide = clamp(width, whole[2] / 60, whole[2]), high = wide * whole[3] / whole[2];
  view = [clamp(x, 0, whole[2] - wide), clamp(y, 0, whole[3] - high), wide, high];
  draw();
}
function zoom(factor, across = 0.5, down = 0.5) {
  const wide = clamp(view[2] * factor, whole[2] / 60, whole[2]);
  const less = view[2] - wide;
  show(view[0] + across * less, view[1] + down * less * whole[3] / whole[2], wide);
}
function choose() {
  for (const one of document.querySelectorAll(".chosen")) one.classList.remove("chosen");
  const number = (/^#(?:site|mark)-(\d+)$/.exec(location.hash) || [])[1];
  const mark = document.getElementById(`mark-${number}`);
  if (!mark) return;
  mark.classList.add("chosen");
  document.getElementById(`site-${number}`).classList.add("chosen");
  reveal(mark);
}
function reveal(mark) {
  const [x, y] = mark.dataset.at.split(" ").map(Number);
  const inside = x > view[0] && y > view[1] && x < view[0] + view[2] && y < view[1] + view[3];
  if (!inside) show(x - view[2] / 2, y - view[3] / 2, view[2]);
}
map.addEventListener("wheel", event => {
  const box = map.getBoundingClientRect();
  event.preventDefault();
  zoom(event.deltaY < 0 ? 0.8 : 1.25, (event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
}, { passive: false });
map.addEventListener("pointerdown", event => {
  if (view[2] < whole[2]) drag = { x: event.clientX, y: event.clientY, view, moved: false };
});
window.addEventListener("pointermove", event => {
  if (!drag) return;
  const unit = drag.view[2] / map.clientWidth, x = event.clientX - drag.x, y = event.clientY - drag.y;
  drag.moved ||= Math.hypot(x, y) > 4;
  if (drag.moved) show(drag.view[0] - x * unit, drag.view[1] - y * unit, drag.view[2]);
});
const release = () => setTimeout(() => { drag = null; });
for (const end of ["pointerup", "pointercancel"]) window.addEventListener(end, release);
map.addEventListener("click", event => { if (drag && drag.moved) event.preventDefault(); });
map.addEventListener("dragstart", event => event.preventDefault());
map.addEventListener("focusin", event => reveal(event.target.closest(".mark")));
for (const button of document.querySelectorAll("[data-zoom]")) {
  const factor = Number(button.dataset.zoom);
  button.addEventListener("click", () => factor ? zoom(factor) : show(0, 0, whole[2]));
}
const body = document.querySelector("tbody"), heads = [...document.querySelectorAll("thead th")];
heads.forEach((head, column) => head.querySelector("button")?.addEventListener("click", () => {
  const falls = head.getAttribute("aria-sort") === "ascending" ? -1 : 1, key = row => row.cells[column];
  const order = head.className ? (a, b) => key(a).dataset.value - key(b).dataset.value
    : (a, b) => key(a).textContent.localeCompare(key(b).textContent);
  for (const other of heads) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", falls > 0 ? "ascending" : "descending");
  body.append(...[...body.rows].sort((a, b) => falls * order(a, b)));
}));
document.querySelector(".zoom").hidden = false;
window.addEventListener("resize", draw);
window.addEventListener("hashchange", choose);
draw();
choose();
"""
