// Following the file behind the page: asks for news each second.

import { ask } from "./server.js";

const EVERY = 1000; // milliseconds

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
