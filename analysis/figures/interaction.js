(() => {
  "use strict";
  const all = (selector, within = document) => [...within.querySelectorAll(selector)];
  const marks = all(".mark"), rows = all("tr[data-key]");
  if (!marks.length) return;
  const keysOf = (each) => (each.dataset.key || "").split("\t").filter(Boolean);
  const detailsOf = (mark) => mark.dataset.details.split("\n").map((line) => line.split("\t"));
  const made = (name, words, className = "") => {
    const element = document.createElement(name);
    element.textContent = words;
    if (className) element.className = className;
    return element;
  };

  // What can be reached: one stop of the Tab key in each figure and table, from there the arrow keys go on.
  for (const mark of marks) {
    mark.setAttribute("role", mark.dataset.key ? "button" : "img");
    mark.setAttribute("aria-label", detailsOf(mark).map((pair) => pair.filter(Boolean).join(": ")).join(", "));
    mark.setAttribute("tabindex", "-1");
  }
  for (const row of rows) row.setAttribute("tabindex", "-1");
  const place = (each) => each.closest(".drawing, tbody");
  const among = (each) => all(".mark, tr[data-key]", place(each));
  for (const first of new Set([...marks, ...rows].map((each) => among(each)[0]))) first.setAttribute("tabindex", "0");

  // The numbers of a mark, beside it.
  const tip = made("div", "", "tip");
  tip.hidden = true;
  tip.setAttribute("aria-hidden", "true");
  const hide = () => { tip.hidden = true; };
  const show = (mark) => {
    tip.replaceChildren(...detailsOf(mark).map(([name, value]) => {
      const line = made("div", "");
      line.append(made("span", name), made("b", value ?? ""));
      return line;
    }));
    tip.hidden = false;
    const box = mark.getBoundingClientRect(), own = tip.getBoundingClientRect();
    const width = document.documentElement.clientWidth;
    const left = Math.max(8, Math.min(box.left + box.width / 2 - own.width / 2, width - own.width - 8));
    const above = box.top - own.height - 10;
    const top = above > 8 ? above : Math.max(8, Math.min(box.bottom + 10, innerHeight - own.height - 8));
    tip.style.left = `${left + scrollX}px`;
    tip.style.top = `${top + scrollY}px`;
  };

  // The same key in every figure and table.
  const bar = made("div", "", "chosen-bar"), said = made("span", ""), clear = made("button", "Clear (Esc)");
  bar.hidden = true;
  bar.setAttribute("role", "status");
  clear.type = "button";
  bar.append(said, clear);
  document.body.append(tip, bar);
  let chosen = "", pointed = null;
  const counted = (number, word) => `${number} ${word}${number === 1 ? "" : "s"}`;
  const choose = (key, from) => {
    chosen = key;
    document.body.classList.toggle("choosing", key !== "");
    const own = [...marks, ...rows].filter((each) => {
      const mine = key !== "" && keysOf(each).includes(key);
      each.classList.toggle("chosen", mine);
      if (each.getAttribute("role") === "button") each.setAttribute("aria-pressed", String(mine));
      return mine;
    });
    bar.hidden = key === "";
    if (key === "") return;
    const figures = new Set(own.map((each) => each.closest(".drawing")).filter(Boolean)).size;
    said.textContent = `${key}: in ${counted(figures, "figure")} and ` +
      counted(own.filter((each) => each.matches("tr")).length, "row");
    for (const table of new Set(own.filter((each) => each.matches("tr")).map((row) => row.closest(".scroll")))) {
      const row = table && !table.contains(from) && table.querySelector("tr.chosen");
      if (row) table.scrollTop = row.offsetTop - table.clientHeight / 2;
    }
  };
  const toggle = (each) => {
    const keys = keysOf(each);
    if (keys.length) choose(keys.includes(chosen) ? "" : keys[0], each);
  };

  // A mark that is too small to be met exactly is met from a little way off, by a finger from further.
  const near = (event) => {
    const drawing = event.target.closest?.(".drawing");
    let found = null, least = event.pointerType === "touch" ? 18 : 7;
    for (const mark of drawing ? all(".mark", drawing) : []) {
      const box = mark.getBoundingClientRect();
      const far = Math.hypot(Math.max(box.left - event.clientX, 0, event.clientX - box.right),
        Math.max(box.top - event.clientY, 0, event.clientY - box.bottom));
      if (far < least) [found, least] = [mark, far];
    }
    return found;
  };
  const target = (event) => event.target.closest?.(".mark, tr[data-key]") ?? null;
  const focus = (next) => {
    for (const each of among(next)) each.setAttribute("tabindex", "-1");
    next.setAttribute("tabindex", "0");
    next.focus();
  };
  const moved = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 };
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") {
      pointed = null;
      hide();
      choose("");
      return;
    }
    const each = target(event);
    if (!each || event.ctrlKey || event.altKey || event.metaKey) return;
    const own = among(each), step = moved[event.key];
    if (step) focus(own[(own.indexOf(each) + step + own.length) % own.length]);
    else if (event.key === "Home") focus(own[0]);
    else if (event.key === "End") focus(own[own.length - 1]);
    else if (event.key === "Enter" || event.key === " ") toggle(each);
    else return;
    event.preventDefault();
  });
  document.addEventListener("click", (event) => {
    const each = target(event) ?? near(event);
    if (event.target === clear) choose("");
    else if (!each) { if (event.target.closest?.(".drawing")) { hide(); choose(""); } }
    else if (each.matches(".mark")) { show(each); toggle(each); }
    else if (String(getSelection()) === "") toggle(each);
  });
  document.addEventListener("pointermove", (event) => {
    if (event.pointerType === "touch") return;
    const own = event.target.closest?.(".mark") ?? near(event);
    if (own === pointed) return;
    pointed = own;
    if (own) show(own);
    else hide();
  });
  document.documentElement.addEventListener("pointerleave", () => { pointed = null; hide(); });
  document.addEventListener("focusin", (event) => { if (event.target.matches?.(".mark")) show(event.target); });
  document.addEventListener("focusout", (event) => { if (event.target.matches?.(".mark")) hide(); });
})();
