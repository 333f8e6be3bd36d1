/* Says so where the server behind the page has ended: nothing on the page would tell. */
"use strict";
(() => {
  const EVERY = 1500;
  const banner = document.createElement("div");
  banner.id = "lost";
  banner.setAttribute("role", "alert");
  const ask = async () => {
    let answers = false;
    try {
      answers = (await fetch("alive", { cache: "no-store" })).ok;
    } catch {
      answers = false;
    }
    banner.textContent = answers
      ? ""
      : "The connection is lost: dynident has ended. What was written is in the study; nothing " +
        "else changed. Start `dynident open` again.";
    banner.hidden = answers;
    setTimeout(ask, EVERY);
  };
  document.addEventListener("DOMContentLoaded", () => {
    banner.hidden = true;
    document.body.prepend(banner);
    setTimeout(ask, EVERY);
  });
})();
