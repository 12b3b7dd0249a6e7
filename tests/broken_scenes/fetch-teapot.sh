#!/bin/sh
# Fetches nothing: it is here so that an error can point to it.
