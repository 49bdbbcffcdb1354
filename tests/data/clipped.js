// What of a page's article nobody sees without luck: the body of a function, for tests of pages in a browser.
// Returns a line for each: beyond the page's edges, cut off by its box, code that has to be scrolled, pictures not there.
const width = document.documentElement.clientWidth, found = [];
const line = (element, why) => `${element.tagName} ${why}: ${element.textContent.trim().slice(0, 50)}`;
const flows = (element) => getComputedStyle(element).overflowX;
const scrolled = (element) => {
  for (let box = element.parentElement; box && box.tagName !== "ARTICLE"; box = box.parentElement)
    if (/auto|scroll|hidden|clip/.test(flows(box))) return true;
  return false;
};
if (document.documentElement.scrollWidth > width) found.push(`HTML is ${document.documentElement.scrollWidth} px wide`);
for (const element of document.querySelectorAll("article, article *")) {
  if (element.tagName === "IMG" && !element.naturalWidth) found.push(line(element, "not there"));
  const place = element.getBoundingClientRect();
  if (!place.width || !place.height || getComputedStyle(element).visibility === "hidden") continue;
  if ((place.right > width + 1 || place.left < -1) && !scrolled(element)) found.push(line(element, "beyond the page"));
  if (element.scrollWidth <= element.clientWidth + 1 || !element.clientWidth) continue;
  if (/hidden|clip/.test(flows(element))) found.push(line(element, "cut off"));
  // The help of a command, and what a terminal prints, keep their 100 columns on a telephone.
  const columns = width < 600 && element.closest(".highlight-text, .highlight-console");
  if (element.tagName === "PRE" && !columns) found.push(line(element, "to be scrolled"));
}
return found;
