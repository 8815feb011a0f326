// What the page asks this machine's own server: the state, pictures, spots, and what is to be done.

async function answer(response) {
  const value = await response.json();
  if (!response.ok) throw new Error(value.error ?? `the server answers ${response.status}`);
  return value;
}

export async function stateNow() {
  return answer(await fetch("state"));
}

export async function progressNow() {
  return answer(await fetch("progress"));
}

export async function spotsIn(frame) {
  return answer(await fetch(`spots/${frame}`));
}

export async function done(event) {
  const headers = { "Content-Type": "application/json" };
  return answer(await fetch("do", { method: "POST", headers, body: JSON.stringify(event) }));
}

export function pictureAddress(row) {
  return `picture/${row}`;
}
