/* Answers one received command. */
#ifndef COMMANDS_H
#define COMMANDS_H
#include "frame.h"

void commands_init(void); /* the defaults of the message table */
void commands_answer(struct frame *f); /* the command goes in, its answer comes out */

#endif
