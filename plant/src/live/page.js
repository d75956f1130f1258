"use strict";
// The server makes the table, escaped; whoever looks is told when it is not followed any more.
const link = document.getElementById("link");
const source = new EventSource("events");
const said = (text, isGone) => {
  link.textContent = text;
  link.classList.toggle("gone", isGone);
};
source.addEventListener("message", ({ data }) => {
  document.getElementById("monitors").innerHTML = data;
  said("Live.", false);
});
source.addEventListener("error", () => said(`The server is gone since ${new Date().toLocaleTimeString()}; what is shown is as old as that.`, true));
