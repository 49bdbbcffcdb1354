"use strict";
// Plays, stops and seeks what show(instant) draws, from `instant` to `duration` [s]; gives what draws it anew.
function player(duration, instant, show) {
  const play = document.getElementById("play"), slider = document.getElementById("instant");
  const clock = document.getElementById("clock"), speed = document.getElementById("speed");
  let last = null;

  function draw() {
    show(instant);
    slider.value = 1000 * instant / duration;
    clock.textContent = `${instant.toFixed(2)} s`;
    slider.setAttribute("aria-valuetext", clock.textContent);
  }
  function tick(now) {
    if (last === null) return;
    // a page that was busy or hidden goes on where it was, rather than jumping to the end
    instant += Math.min(Math.max(now - last, 0), 100) / 1e3 * Number(speed.value);
    last = now;
    if (instant >= duration) { instant = duration; stop(); }
    draw();
    requestAnimationFrame(tick);
  }
  function stop() { last = null; play.textContent = "Play"; }
  play.addEventListener("click", () => {
    if (last !== null) return stop();
    if (instant >= duration) instant = 0;
    play.textContent = "Pause";
    last = performance.now();
    requestAnimationFrame(tick);
  });
  slider.addEventListener("input", () => { instant = duration * slider.value / 1000; draw(); });
  return draw;
}
