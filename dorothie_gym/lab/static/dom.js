// Elements of the page, made by code: attributes, children, icons.

const SVG = 'http://www.w3.org/2000/svg';

/** Returns an element. `props` are attributes; functions are listeners, `class` and `text` as named, booleans are flags. */
export function h(tag, props = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(props)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === 'function') element.addEventListener(name.replace(/^on/, ''), value);
    else if (name === 'text') element.textContent = value;
    else element.setAttribute(name, value === true ? '' : value);
  }
  element.append(...children.flat().filter(child => child !== null && child !== undefined));
  return element;
}

const ICONS = {
  arrow: 'M12 20V5m0 0-5.500 5.500M12 5l5.500 5.500',
  uturn: 'M16 20V10a5 5 0 0 0-10 0v4m0 0 3.500-3.500M6 14l-3-3.500',
  stop: 'M8 3h8l5 5v8l-5 5H8l-5-5V8zM8.500 12h7',
  go: 'M7 4.500v15l12-7.500z',
  faster: 'm5 12 7-7 7 7M5 19l7-7 7 7',
  slower: 'm5 5 7 7 7-7M5 12l7 7 7-7',
  lights: 'M10 6H8a6 6 0 0 0 0 12h2zM14 8h7M14 12h7M14 16h7',
  lane: 'M7 21 10 3M17 21 14 3',
  left: 'M20 20c0-8-8-4-8-13m0 0L7.500 11.500M12 7l4.500 4.500',
  right: 'M4 20c0-8 8-4 8-13m0 0 4.500 4.500M12 7l-4.500 4.500',
  microphone: 'M12 3a3 3 0 0 0-3 3v6a3 3 0 0 0 6 0V6a3 3 0 0 0-3-3zM6 11v1a6 6 0 0 0 12 0v-1M12 18v3',
  send: 'M4 12 20 4l-5 16-3.500-6.500z',
  eye: 'M2 12s3.500-6.500 10-6.500S22 12 22 12s-3.500 6.500-10 6.500S2 12 2 12zm10-2.800a2.800 2.800 0 1 0 0 5.600 2.800 2.800 0 0 0 0-5.600z',
  pin: 'M12 21s7-6.500 7-11.500a7 7 0 0 0-14 0C5 14.500 12 21 12 21zm0-14a2.500 2.500 0 1 0 0 5 2.500 2.500 0 0 0 0-5z',
  flag: 'M6 21V4m0 1h11l-2.500 3.500L17 12H6',
  route: 'M6 19a2 2 0 1 0 0-.010M18 5a2 2 0 1 0 0-.010M8 19h7a3.500 3.500 0 0 0 0-7H9a3.500 3.500 0 0 1 0-7h7',
  check: 'm5 12.500 4.500 4.500L19 7.500',
  cross: 'm6 6 12 12M18 6 6 18',
  dot: 'M12 9a3 3 0 1 0 0 6 3 3 0 0 0 0-6z',
  clock: 'M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18zm0 4v5.500l3.500 2',
  pause: 'M8 5v14M16 5v14',
  target: 'M12 5a7 7 0 1 0 0 14 7 7 0 0 0 0-14zm0-3v5m0 10v5M2 12h5m10 0h5',
  plus: 'M12 5v14M5 12h14', minus: 'M5 12h14',
  help: 'M9 9a3 3 0 1 1 4.500 2.600c-1 .600-1.500 1.200-1.500 2.400m0 3.500v.010M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18z',
};

/** Returns an icon, turned clockwise by an angle in degrees; icons are decoration, labels are text. */
export function icon(name, turn = 0) {
  const svg = document.createElementNS(SVG, 'svg');
  svg.setAttribute('viewBox', '0 0 24 24');
  svg.setAttribute('class', name === 'uturn' ? 'icon uturn' : 'icon');
  svg.setAttribute('aria-hidden', 'true');
  const path = document.createElementNS(SVG, 'path');
  path.setAttribute('d', ICONS[name]);
  if (turn) path.setAttribute('transform', `rotate(${turn} 12 12)`);
  svg.append(path);
  return svg;
}

/** Returns a button with an icon, a label, and the key that presses it. */
export function button(label, { glyph, turn, key, run, ...props } = {}) {
  return h('button', { type: 'button', onclick: run, ...(key && { 'aria-keyshortcuts': key }), ...props },
    glyph ? icon(glyph, turn) : null, h('span', { class: 'label', text: label }),
    key ? h('kbd', { 'aria-hidden': 'true', text: shownKey(key) }) : null);
}

export const shownKey = key => ({ ArrowUp: '↑', ArrowDown: '↓', ' ': 'Space' })[key] ?? (key.length === 1 ? key.toUpperCase() : key);

/** Returns a titled part of the page. */
export function panel(title, props = {}, ...children) {
  const id = `panel-${title.toLowerCase().replace(/\W+/g, '-')}`;
  return h('section', { 'aria-labelledby': id, ...props, class: `panel ${props.class ?? ''}` },
    h('h2', { id, text: title }), ...children);
}

/** Replaces the children of an element if `key` has changed since the last time. */
export function rebuild(element, key, make) {
  const text = JSON.stringify(key);
  if (element.dataset.key === text) return;
  element.dataset.key = text;
  const focused = element.contains(document.activeElement) ? document.activeElement.dataset.id : null;
  element.replaceChildren(...make());
  if (focused) element.querySelector(`[data-id="${CSS.escape(focused)}"]`)?.focus();
}

/** Shows a short notice; it is read out by screen readers. */
export function notice(text, kind = 'info') {
  const box = document.getElementById('notices');
  const line = h('p', { class: kind, text });
  box.append(line);
  while (box.children.length > 4) box.firstChild.remove();
  setTimeout(() => line.remove(), 7000);
}

export const clock = seconds => `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, '0')}`;
const LABELS = { constructioncone: 'construction cone', streetbarrier: 'street barrier', trafficcone: 'traffic cone', trafficsign: 'traffic sign', trafficwarning: 'warning sign', SevenEleven: 'Seven-Eleven' };

/** Returns a text with a capital letter at its beginning. */
export const sentence = text => text[0].toUpperCase() + text.slice(1);

/** Returns a label of a vocabulary as words. */
export const words = label => LABELS[label] ?? label.replace(/([a-z])([A-Z])/g, '$1 $2');
