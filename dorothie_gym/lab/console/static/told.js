// Places that the Co-Wizard was told: those that the passenger has named, as the recogniser understood them.

/**
 * Returns for each row of the landmarks, or for the name of one that is not on the map, when it was told.
 * @param heard lines of the talk with `places` and `streets`, in order.
 * @param landmarks rows of the map.
 * @param streetNames names of the streets.
 * @param several landmarks of which a town may have several.
 * @returns map to `number` in the order of telling, `mark` for the pin, `sure` (whether one pin alone is meant), `text`, `t`.
 */
export function toldPlaces(heard, landmarks, streetNames, several) {
  const told = new Map();
  let count = 0;
  for (const { places, streets, text, t } of heard) {
    for (const name of places) {
      const { pins, elsewhere } = pinsOf(name, streets, landmarks, streetNames, told), keys = pins.length ? pins : [name];
      const sure = keys.length === 1 && !(elsewhere && several.includes(name));  // a house on another street may be one that is not on the map
      if (!sure && keys.every(key => told.get(key)?.sure)) continue;
      const number = keys.map(key => told.get(key)).find(before => before && before.sure === sure)?.number ?? ++count;
      if (sure) for (const [key, { sure: before }] of told) if (!before && landmarks[key]?.[0] === name) told.delete(key);
      for (const key of keys) told.set(key, { number, mark: sure ? String(number) : `${number}?`, sure, text, t });
    }
  }
  return told;
}

/**
 * Returns the pins that a name may mean: those on a street that was named, or the one that was told last, or all;
 * and whether the streets that were named lead elsewhere.
 */
function pinsOf(name, streets, landmarks, streetNames, told) {
  const pins = landmarks.flatMap(([other], k) => (other === name ? [k] : []));
  const there = pins.filter(k => streets.includes(streetNames[landmarks[k][6]]));
  if (there.length || streets.length) return { pins: there.length ? there : pins, elsewhere: !there.length };
  const known = pins.filter(k => told.get(k)?.sure).sort((a, b) => told.get(b).t - told.get(a).t);
  return { pins: pins.length > 1 && known.length ? [known[0]] : pins, elsewhere: false };
}
