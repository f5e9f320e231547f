// What the page asks of the server that it comes from. Addresses are relative: the page's own has the secret.
import { parsed } from "./named.js";
import { unpackBytes } from "./packed.js";

async function asked(path, body) {
  const given = body === undefined ? {} : { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) };
  const answer = await fetch(path, given);
  if (answer.ok) return answer;
  const { error } = await answer.json().catch(() => ({ error: `status ${answer.status}` }));
  throw new Error(error);
}

export const runs = async () => parsed(await (await asked("runs")).text());

export const run = async (number) => unpackBytes(new Uint8Array(await (await asked(`runs/${number}`)).arrayBuffer()));

// What is known of a design, in kPa, and how much of its sweep is still to be solved.
export const sweep = async (number, design, start) => parsed(await (await asked(`runs/${number}/designs/${design}/sweep`, { start })).text());

// A state at pressures in kPa; null where a newer demand came first.
export async function state(number, design, pressures) {
  const content = await (await asked(`runs/${number}/designs/${design}/state`, pressures)).arrayBuffer();
  return content.byteLength > 0 ? unpackBytes(new Uint8Array(content)) : null;
}
