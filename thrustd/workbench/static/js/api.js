// The server, by relative addresses: the token is part of the page's own.
export class Problem extends Error {}

async function answer(response) {
  if (response.ok) return response;
  let line = `${response.status} ${response.statusText}`;
  try {
    line = (await response.clone().json()).error ?? line;
  } catch {
    line = (await response.text()) || line;
  }
  throw new Problem(line);
}

const send = (method, path, body) =>
  fetch(path, { method, body }).then(answer, () => {
    throw new Problem("The workbench does not answer. Is thrustd workbench still running?");
  });
export const get = (path) => send("GET", path).then((r) => r.json());
export const getBytes = (path, signal) =>
  fetch(path, { signal })
    .then(answer)
    .then((r) => r.arrayBuffer());
export const post = (path, value) =>
  send("POST", path, typeof value === "string" ? value : JSON.stringify(value)).then((r) => r.json());
export const put = (path, body) => send("PUT", path, body).then((r) => r.json());
export const remove = (path) => send("DELETE", path).then((r) => r.json());

export const query = (values) => {
  const pairs = new URLSearchParams();
  for (const [name, value] of Object.entries(values)) for (const one of [value].flat()) pairs.append(name, one);
  return pairs.toString();
};
export const inUrl = (name) => name.split("/").map(encodeURIComponent).join("/");
export const fileUrl = (name) => "api/files/" + inUrl(name);
