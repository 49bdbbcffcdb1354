"use strict";
// Leaves the runs that contain all words typed, but for words of their lineage, of a command and in a state; a link to a hidden one shows all again.
{
  const search = document.getElementById("search"), command = document.getElementById("command"), state = document.getElementById("state");
  const list = document.getElementById("runs"), count = document.getElementById("count"), nothing = document.getElementById("nothing");

  function choose() {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const run of list.children) {
      const fits = (!command.value || run.dataset.command === command.value) && (!state.value || run.dataset.state === state.value);
      const text = words.length ? run.querySelector(".own").textContent.toLowerCase() : "";
      run.hidden = !fits || !words.every(word => text.includes(word));
      shown += !run.hidden;
    }
    const all = list.children.length;
    count.textContent = shown === all ? `${all} runs, newest first` : `${shown} of ${all} runs, newest first`;
    nothing.hidden = shown > 0;
  }
  for (const field of [search, command, state]) field.addEventListener("input", choose);
  search.form.addEventListener("submit", event => event.preventDefault());

  function follow() {
    const run = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!run || !run.hidden) return;
    search.value = command.value = state.value = "";
    choose();
    run.scrollIntoView();
  }
  addEventListener("hashchange", follow);

  // From `wristctl runs serve` it is asked for anew, where it is looked at; what has not changed is not sent again.
  async function renew() {
    if (document.hidden) return;
    const answer = await fetch(location.pathname, { headers: { "If-None-Match": `"${list.dataset.mark}"` } }).catch(() => null);
    if (!answer || answer.status !== 200) return;
    const fresh = new DOMParser().parseFromString(await answer.text(), "text/html");
    list.dataset.mark = fresh.getElementById("runs").dataset.mark;
    list.replaceChildren(...fresh.getElementById("runs").children);
    for (const select of [command, state]) {
      const chosen = select.value;
      select.replaceChildren(...fresh.getElementById(select.id).children);
      select.value = chosen;
      if (select.selectedIndex < 0) select.value = "";
    }
    choose();
  }
  if (location.protocol === "http:") setInterval(renew, 3000);
  choose();
  follow();
}
