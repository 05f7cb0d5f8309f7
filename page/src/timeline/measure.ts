/** Pixels left of the axis for names and numbers, and right of it; `style/time.css` has the same. */
export const GUTTER = 78;
export const MARGIN = 14;
