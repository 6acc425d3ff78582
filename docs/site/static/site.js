// Animations can be stopped, and are stopped for readers who asked their system for less motion.
// The theme's menus are labels of hidden checkboxes; here they become buttons that the keyboard reaches.
"use strict";

function frozen(image) {
  const canvas = document.createElement("canvas");
  canvas.width = image.naturalWidth;
  canvas.height = image.naturalHeight;
  canvas.getContext("2d").drawImage(image, 0, 0);
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", image.alt);
  return canvas;
}

function motionButton(animations) {
  const button = document.createElement("button");
  const stills = new Map();
  button.type = "button";
  button.className = "motion";
  const show = (moving) => {
    for (const image of animations) {
      if (moving) {
        stills.get(image)?.replaceWith(image);
        stills.delete(image);
      } else if (!stills.has(image)) {
        const still = frozen(image);
        stills.set(image, still);
        image.replaceWith(still);
      }
    }
    button.textContent = moving ? "Stop animations" : "Play animations";
    button.dataset.moving = String(moving);
  };
  button.addEventListener("click", () => show(button.dataset.moving !== "true"));
  show(true);
  if (window.matchMedia("(prefers-reduced-motion: reduce)").matches) {
    const loaded = animations.map((image) => image.decode().catch(() => undefined));
    Promise.all(loaded).then(() => show(false));
  }
  return button;
}

function reachable(label, drawer) {
  const box = document.getElementById(label.htmlFor);
  label.tabIndex = 0;
  label.setAttribute("role", "button");
  label.setAttribute("aria-label", box.getAttribute("aria-label"));
  const tell = () => label.setAttribute("aria-expanded", String(box.checked));
  box.addEventListener("change", tell);
  tell();
  label.addEventListener("keydown", (event) => {
    if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      box.click();
      if (box.checked) drawer?.querySelector("a, input")?.focus();
    }
  });
}

// What a narrow screen has outside of its edge must not take the focus.
function outOfReach(drawer, box) {
  const update = () => {
    drawer.inert = !box.checked && getComputedStyle(drawer).position === "fixed";
  };
  box.addEventListener("change", update);
  window.addEventListener("resize", update);
  update();
}

document.addEventListener("DOMContentLoaded", () => {
  const animations = [...document.querySelectorAll("article img")].filter((image) => /\.gif$/.test(image.src));
  if (animations.length) {
    document.querySelector("article h1").after(motionButton(animations));
  }
  for (const [name, side, labels] of [
    ["__navigation", ".sidebar-drawer", ".nav-overlay-icon"],
    ["__toc", ".toc-drawer", ".toc-overlay-icon:not(.no-toc)"],
  ]) {
    const drawer = document.querySelector(side);
    if (drawer) outOfReach(drawer, document.getElementById(name));
    document.querySelectorAll(labels).forEach((label) => reachable(label, drawer));
  }
  document.querySelectorAll(".sidebar-tree label[for]").forEach((label) => reachable(label));
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") {
      for (const name of ["__navigation", "__toc"]) {
        const box = document.getElementById(name);
        if (box?.checked) {
          box.click();
          document.querySelector(`label[for=${name}]:not(.overlay)`)?.focus();
        }
      }
    }
  });
  document.querySelectorAll(".table-wrapper, .highlight pre").forEach((box) => {
    if (box.scrollWidth > box.clientWidth) box.tabIndex = 0;
  });
});
