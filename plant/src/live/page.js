"use strict";
// The server makes what is live, escaped; whoever looks is told when it is not followed any more.
const link = document.getElementById("link");
const form = document.getElementById("acknowledge");
const frame = document.getElementById("figures");
const source = new EventSource(document.body.dataset.events);
const said = (text, isGone) => {
  link.textContent = text;
  link.classList.toggle("gone", isGone);
};
// What is acknowledged is what is shown.
const follow = (alarm) => {
  form.hidden = !alarm;
  form.elements.state.value = alarm?.dataset.state ?? "";
  form.elements.since_us.value = alarm?.dataset.since ?? "0";
};
source.addEventListener("message", ({ data }) => {
  document.getElementById("live").innerHTML = data;
  if (form) follow(document.getElementById("alarm"));
  said("Live.", false);
});
source.addEventListener("error", () => said(`No connection to the server since ${new Date().toLocaleTimeString()}; the page shows the state of that time.`, true));
// The figures are as high as they are, which grows while they are drawn, and only the page is scrolled.
const fit = () => {
  const inside = frame.contentDocument?.documentElement;
  const height = `${inside?.offsetHeight}px`;
  if (inside?.offsetHeight && frame.style.height !== height) frame.style.height = height;
};
if (frame) setInterval(fit, 500);
