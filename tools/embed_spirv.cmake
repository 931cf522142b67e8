# SPDX-License-Identifier: Apache-2.0
# Writes a SPIR-V file as a C array of 32-bit words: cmake -DIN=x.spv -DOUT=x.h -DNAME=symbol -P embed_spirv.cmake
file(READ ${IN} bytes HEX)
# Little-endian words: the four bytes of each in reverse.
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${bytes}")
file(WRITE ${OUT} "#pragma once\nconst uint32_t ${NAME}[] = {${words}};\n")
