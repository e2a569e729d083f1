#pragma once

/* 6: write to address 0; 7: abort; 8: exit with code 0; 9: loop for ever; 10: go to another directory. */
void misbehave(int deed);
