// Objects whose keys are names that users choose: without a prototype, so that none has a "constructor" of its own accord.

export const named = (entries) => Object.setPrototypeOf(Object.fromEntries(entries), null);

// What a JSON text says, with all its objects like that.
export const parsed = (text) =>
  JSON.parse(text, (_, value) => (value !== null && typeof value === "object" && !Array.isArray(value) ? Object.setPrototypeOf(value, null) : value));
