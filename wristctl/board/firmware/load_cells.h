/* A load cell for each tendon, behind an HX711 amplifier: read when it has something new, left alone where there is none. */
#ifndef LOAD_CELLS_H
#define LOAD_CELLS_H
#include <stdint.h>

void load_cells_poll(void); /* the main loop, every turn: reads one amplifier at most, and one in each millisecond */
int16_t load_cell_counts(uint8_t axis); /* of 256 of the amplifier's counts: the upper 16 of its 24 bits */
uint8_t load_cell_age_ms(uint8_t axis); /* since that was read; LOAD_CELL_SILENT: nothing for as long, or ever */

#define LOAD_CELL_SILENT 255

#endif
