// Errands of a seat that may know them: numbers in the order of the list, the marks of their pins, their stopping places.

import { COLOURS } from '/static/map.js';

/** Returns the marks of the pins of errands, by row of the landmarks. */
export function errandMarks(tasks) {
  const marks = new Map();
  tasks.forEach((task, k) => {
    const before = marks.get(task.landmark), open = task.live && task.status !== 'complete';
    if (!task.live && task.status !== 'abandoned') return;
    marks.set(task.landmark, {
      text: before ? `${before.text}, ${k + 1}` : String(k + 1),
      colour: !before || (open && !before.open) ? COLOURS[task.status] ?? COLOURS.none : before.colour,
      open: open || before?.open, next: (open && task.allowed) || before?.next,
    });
  });
  return marks;
}

/** Returns the stopping places of the marked pins at which a stop would count now. */
export function nextStops({ landmarks = [] }, marks) {
  return [...marks].filter(([pin, mark]) => mark.next && landmarks[pin]).map(([pin, { colour }]) => ({ name: landmarks[pin][3], x: landmarks[pin][4], y: landmarks[pin][5], colour }));
}
