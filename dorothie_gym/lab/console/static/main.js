// Start of the page: the seat of the link's secret.

import { h } from '/static/dom.js';
import { openSeat } from './seat_page.js';

const token = location.hash.slice(1);
if (token) openSeat(token);
else document.getElementById('main').replaceChildren(h('div', { class: 'card' }, h('h1', { text: 'dorothie_gym console' }), h('p', { text: 'Open the link of your seat. It ends in # and a secret, which belongs to the link.' })));
