// Saving the surface shown as a project: the page asks for a name, and again before it replaces a file.

import { ask } from "./server.js";

/** `session()` names the session; `notify(text)` shows how it ended. */
export function addSaving(opener, dialog, header, session, notify) {
  opener.hidden = !header.project;
  const [name, replace, message] = ["input[type=text]", "input[type=checkbox]", ".message"]
    .map((selector) => dialog.querySelector(selector));
  const suggested = header.file.replace(/\.[^.]+$/, "");
  opener.onclick = () => {
    name.value ||= `${suggested}${header.file.endsWith(".toml") ? "-variant" : ""}.toml`;
    replace.checked = false;
    message.textContent = "";
    dialog.showModal();
    name.select();
  };
  dialog.querySelector(".same").hidden = !header.file.endsWith(".toml");
  dialog.querySelector(".same").textContent = `Use ${header.file}`;
  dialog.querySelector(".same").onclick = () => {
    name.value = header.file;
    replace.checked = true;
  };
  dialog.querySelector(".cancel").onclick = () => dialog.close();
  dialog.querySelector("form").onsubmit = async (event) => {
    event.preventDefault();
    message.textContent = "Saving…";
    try {
      const { header: answer } = await ask(`api/${session()}/save`, { name: name.value, replace: replace.checked });
      dialog.close();
      notify(`Saved as ${answer.saved}${answer.note ? `, ${answer.note}` : ""}.`);
    } catch (error) {
      message.textContent = error.message;
    }
  };
}
