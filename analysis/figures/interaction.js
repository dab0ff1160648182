(() => {
  "use strict";
  const marks = [...document.querySelectorAll(".mark")];
  const rows = [...document.querySelectorAll("tr[data-key]")];
  if (!marks.length) return;

  const tip = document.createElement("div");
  tip.className = "tip";
  tip.hidden = true;
  document.body.append(tip);

  const show = (mark) => {
    tip.replaceChildren(...JSON.parse(mark.dataset.told).map(([name, value]) => {
      const line = document.createElement("div");
      const label = document.createElement("span");
      label.textContent = name;
      const number = document.createElement("b");
      number.textContent = value;
      line.append(label, number);
      return line;
    }));
    tip.hidden = false;
    const box = mark.getBoundingClientRect(), own = tip.getBoundingClientRect();
    const left = Math.min(Math.max(8, box.left + box.width / 2 - own.width / 2), innerWidth - own.width - 8);
    const above = box.top - own.height - 10;
    tip.style.left = `${left + scrollX}px`;
    tip.style.top = `${(above > 8 ? above : Math.min(box.bottom + 10, innerHeight - own.height - 8)) + scrollY}px`;
  };
  const hide = () => { tip.hidden = true; };

  let chosen = "";
  const choose = (key, from) => {
    chosen = key === chosen ? "" : key;
    document.body.classList.toggle("choosing", chosen !== "");
    for (const each of [...marks, ...rows]) each.classList.toggle("chosen", chosen !== "" && each.dataset.key === chosen);
    if (chosen === "") return;
    for (const row of rows) {
      const whole = row.closest("details");
      if (row.dataset.key === chosen && whole && whole.open && from && !row.contains(from)) {
        const scroll = row.closest(".scroll");
        if (scroll) scroll.scrollTop = row.offsetTop - scroll.clientHeight / 2;
      }
    }
  };

  const beside = (mark, step) => {
    const own = [...mark.closest(".drawing").querySelectorAll(".mark")];
    return own[(own.indexOf(mark) + step + own.length) % own.length];
  };
  const focus = (mark) => {
    for (const each of mark.closest(".drawing").querySelectorAll(".mark")) each.setAttribute("tabindex", "-1");
    mark.setAttribute("tabindex", "0");
    mark.focus();
  };
  const keys = (event) => {
    const mark = event.currentTarget;
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (step) focus(beside(mark, step));
    else if (event.key === "Enter" || event.key === " ") { if (mark.dataset.key) choose(mark.dataset.key, mark); }
    else return;
    event.preventDefault();
  };

  for (const mark of marks) {
    mark.addEventListener("pointerenter", () => show(mark));
    mark.addEventListener("pointerleave", hide);
    mark.addEventListener("focus", () => show(mark));
    mark.addEventListener("blur", hide);
    mark.addEventListener("keydown", keys);
    mark.addEventListener("click", (event) => {
      if (mark.dataset.key) choose(mark.dataset.key, mark);
      event.stopPropagation();
    });
  }
  for (const row of rows) row.addEventListener("click", (event) => { choose(row.dataset.key, row); event.stopPropagation(); });
  document.addEventListener("keydown", (event) => { if (event.key === "Escape") { hide(); if (chosen) choose(chosen); } });
  document.addEventListener("click", () => { if (chosen) choose(chosen); });
})();
