// The file behind the page: its news, and saving the surface shown as a project.

import { ask } from "./server.js";

const EVERY = 1000; // milliseconds between two looks at the news

/** `renew()` opens the newest roof; the news themselves are shown in `root`. */
export function follow(root, header, session, renew) {
  let { version } = header;
  const say = (text, state) => {
    root.hidden = !text;
    root.dataset.state = state;
    if (root.textContent !== text) root.textContent = text;
  };
  const look = async () => {
    try {
      const { header: news } = await ask(`api/${session()}/news`);
      if (news.version !== version) {
        version = news.version;
        await renew();
      }
      if (news.working) say(`${header.file} was saved: solving…`, "working");
      else if (news.problem) say(`${header.file} was saved, but ${news.problem}. Shown: the last good shape.`, "problem");
      else say(`Following ${header.file}`, "following");
    } catch (error) {
      say(error.message, "problem");
    }
    setTimeout(look, EVERY);
  };
  if (header.watching) look();
}

/** The page asks for a name, and again before it replaces a file; `notify(text)` shows how it ended. */
export function addSaving(opener, dialog, { project, file }, session, notify) {
  const parts = ["[type=text]", "[type=checkbox]", ".message", ".same", ".cancel"];
  const [name, replace, message, same, cancel] = parts.map((selector) => dialog.querySelector(selector));
  opener.hidden = !project;
  opener.onclick = () => {
    name.value ||= `${file.replace(/\.[^.]+$/, "")}${file.endsWith(".toml") ? "-variant" : ""}.toml`;
    replace.checked = false;
    message.textContent = "";
    dialog.showModal();
    name.select();
  };
  Object.assign(same, { hidden: !file.endsWith(".toml"), textContent: `Use ${file}` });
  same.onclick = () => {
    name.value = file;
    replace.checked = true;
  };
  cancel.onclick = () => dialog.close();
  dialog.querySelector("form").onsubmit = async (event) => {
    event.preventDefault();
    message.textContent = "Saving…";
    try {
      const { header } = await ask(`api/${session()}/save`, { name: name.value, replace: replace.checked });
      dialog.close();
      notify(`Saved as ${header.saved}${header.note ? `, ${header.note}` : ""}.`);
    } catch (error) {
      message.textContent = error.message;
    }
  };
}
