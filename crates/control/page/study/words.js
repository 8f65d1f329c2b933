// ---- Texts of the study: headings, paragraphs and lists, as text alone.

/** The blocks of a text as elements. A heading of the text lies below that of the page. */
function blocks(text) {
  return text.map(({ kind, level, text: words, items, ordered }) => {
    if (kind === 'heading') return make('h' + Math.min(6, level + 2), '', words);
    if (kind === 'paragraph') return make('p', '', words);
    const list = make(ordered ? 'ol' : 'ul');
    list.append(...items.map((item) => make('li', '', item)));
    return list;
  });
}
